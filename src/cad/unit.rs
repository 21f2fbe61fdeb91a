//! Units of length, as the three formats name them.

/// The unit that the coordinates of an exported curve are in. Coordinates are written as they are; the unit says how
/// long they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LengthUnit {
    /// Metre.
    #[default]
    Metre,
    /// Centimetre.
    Centimetre,
    /// Millimetre.
    Millimetre,
    /// International inch, 25.4 mm.
    Inch,
    /// International foot, 304.8 mm.
    Foot,
}

/// The names of a unit in the formats.
struct Spelling {
    unit: LengthUnit,
    symbol: &'static str,
    name: &'static str,
    millimetres: f64,
    /// Flag and name of the global section of IGES 5.3.
    iges: (u8, &'static str),
    /// `$INSUNITS` and `$MEASUREMENT` of DXF.
    dxf: (u8, u8),
}

const SPELLINGS: [Spelling; 5] = [
    spelling(LengthUnit::Metre, ["m", "metre"], 1000.0, (6, "M"), (6, 1)),
    spelling(LengthUnit::Centimetre, ["cm", "centimetre"], 10.0, (10, "CM"), (5, 1)),
    spelling(LengthUnit::Millimetre, ["mm", "millimetre"], 1.0, (2, "MM"), (4, 1)),
    spelling(LengthUnit::Inch, ["in", "inch"], 25.4, (1, "IN"), (1, 0)),
    spelling(LengthUnit::Foot, ["ft", "foot"], 304.8, (4, "FT"), (2, 0)),
];

const fn spelling(
    unit: LengthUnit,
    [symbol, name]: [&'static str; 2],
    millimetres: f64,
    iges: (u8, &'static str),
    dxf: (u8, u8),
) -> Spelling {
    Spelling { unit, symbol, name, millimetres, iges, dxf }
}

impl LengthUnit {
    /// The unit of a symbol: `m`, `cm`, `mm`, `in` or `ft`.
    ///
    /// ```
    /// use aeroform::cad::LengthUnit;
    /// assert_eq!(LengthUnit::from_symbol("mm"), Some(LengthUnit::Millimetre));
    /// assert_eq!(LengthUnit::from_symbol("furlong"), None);
    /// ```
    pub fn from_symbol(symbol: &str) -> Option<Self> {
        SPELLINGS.iter().find(|s| s.symbol == symbol).map(|s| s.unit)
    }

    /// The symbols of all units.
    pub fn symbols() -> impl Iterator<Item = &'static str> {
        SPELLINGS.iter().map(|s| s.symbol)
    }

    /// The unit that a section without one is taken to be in: metres for a chord of up to 10, millimetres for a longer
    /// one.
    pub fn likely_for(chord: f64) -> Self {
        if chord > 10.0 { Self::Millimetre } else { Self::Metre }
    }

    fn spelling(self) -> &'static Spelling {
        // the list holds every unit; the first stands for one that is missing
        SPELLINGS.iter().find(|s| s.unit == self).unwrap_or(&SPELLINGS[0])
    }

    /// Symbol of the unit, such as `mm`.
    pub fn symbol(self) -> &'static str {
        self.spelling().symbol
    }

    /// Name of the unit in words, such as `millimetre`.
    pub fn name(self) -> &'static str {
        self.spelling().name
    }

    /// Length of the unit in millimetres.
    pub fn millimetres(self) -> f64 {
        self.spelling().millimetres
    }

    pub(super) fn iges(self) -> (u8, &'static str) {
        self.spelling().iges
    }

    pub(super) fn dxf(self) -> (u8, u8) {
        self.spelling().dxf
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_has_its_spelling() {
        use LengthUnit::{Centimetre, Foot, Inch, Metre, Millimetre};
        for unit in [Metre, Centimetre, Millimetre, Inch, Foot] {
            assert_eq!(LengthUnit::from_symbol(unit.symbol()), Some(unit));
            assert_eq!(unit.spelling().unit, unit);
        }
    }
}
