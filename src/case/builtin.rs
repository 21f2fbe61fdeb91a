//! The built-in cases, embedded in the library.

/// A case that comes with the command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltinCase {
    /// Name of the case, as `aeroform run` takes it.
    pub name: &'static str,
    /// TOML text of the case.
    pub text: &'static str,
}

macro_rules! builtin {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltinCase { name: $name, text: include_str!(concat!("../../validation/cases/", $name, ".toml")) }),*]
    };
}

/// All built-in cases.
pub fn builtin_cases() -> &'static [BuiltinCase] {
    builtin![
        "l2-match",
        "l2-match-newton",
        "l2-match-area",
        "l2-5x5-quadratic",
        "l2-5x5-cubic",
        "l2-6x6-cubic",
        "l2-6x6-greville",
        "l2-8x8-quartic",
        "l2-direct",
        "l2-mixed",
        "mirrored",
        "skewed-pinned",
        "kulfan-5x5",
        "kulfan-7x5",
        "kulfan-5x5-paper",
        "kulfan-7x5-paper",
        "kulfan-free",
        "naca0024-linear-m02",
        "naca0024-cubic-m02",
        "naca0024-quartic-m02",
        "naca0024-linear",
        "naca0024-cubic",
        "naca0024-quartic",
        "rae2822-drag",
        "supercritical-multipoint",
        "multipoint",
        "parametric",
        "best-angle",
        "best-glide",
        "high-lift",
        "laminar-two-reynolds",
    ]
}
