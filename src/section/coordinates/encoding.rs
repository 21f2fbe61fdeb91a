//! From bytes to text: encodings, and formats that hold no plain coordinates.

use crate::section::CoordinateError;

/// Largest file that is read, in bytes; a section of the largest number of points needs a hundredth of this.
pub(super) const LARGEST_FILE: usize = 64 << 20;

/// First bytes of formats that are no text, and what to do with each.
const SIGNATURES: [(&[u8], &str); 12] = [
    (b"\x1f\x8b", "a gzip-compressed file; unpack it first"),
    (b"PK\x03\x04", "a zip archive (or a spreadsheet); unpack it, or save the sheet as CSV"),
    (b"BZh", "a bzip2-compressed file; unpack it first"),
    (b"\xfd7zXZ", "an xz-compressed file; unpack it first"),
    (b"7z\xbc\xaf", "a 7-zip archive; unpack it first"),
    (b"\x28\xb5\x2f\xfd", "a zstd-compressed file; unpack it first"),
    (b"\xd0\xcf\x11\xe0", "a binary spreadsheet or document; save it as CSV"),
    (b"%PDF", "a PDF document; copy the table out of it"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"AutoCAD Binary DXF", "a binary DXF drawing; export the outline as lines of x and y"),
    (b"\x7fELF", "a program"),
];

/// Text of a file in UTF-8, UTF-16 or, where it is neither, Windows-1252, so that old titles survive.
pub(super) fn decode(bytes: &[u8]) -> Result<String, CoordinateError> {
    if bytes.len() > LARGEST_FILE {
        return Err(CoordinateError::TooLarge { bytes: bytes.len() as u64, most: LARGEST_FILE as u64 });
    }
    if let Some((_, format)) = SIGNATURES.iter().find(|(signature, _)| bytes.starts_with(signature)) {
        return Err(CoordinateError::Format { format });
    }
    let text = match utf16(bytes) {
        Some(text) => text,
        None => eight_bit(bytes)?,
    };
    match foreign(&text) {
        Some(format) => Err(CoordinateError::Format { format }),
        None => Ok(text),
    }
}

/// UTF-16 with a byte-order mark, or without one where every other byte is zero.
fn utf16(bytes: &[u8]) -> Option<String> {
    let zeros = |odd: usize| {
        let halves = bytes.get(odd..)?.iter().step_by(2);
        let (count, zero) = halves.fold((0, 0), |(n, z), b| (n + 1, z + usize::from(*b == 0)));
        Some(count > 4 && 10 * zero > 9 * count)
    };
    let (little, rest) = match bytes {
        [0xff, 0xfe, rest @ ..] => (true, rest),
        [0xfe, 0xff, rest @ ..] => (false, rest),
        _ if zeros(1) == Some(true) && zeros(0) == Some(false) => (true, bytes),
        _ if zeros(0) == Some(true) && zeros(1) == Some(false) => (false, bytes),
        _ => return None,
    };
    let units = rest.chunks_exact(2).map(|pair| {
        let pair = [pair[0], pair[1]];
        if little { u16::from_le_bytes(pair) } else { u16::from_be_bytes(pair) }
    });
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    (!text.contains('\0')).then_some(text)
}

fn eight_bit(bytes: &[u8]) -> Result<String, CoordinateError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // 0x1a ended files under DOS
    let bytes = bytes.strip_suffix(b"\x1a").unwrap_or(bytes);
    let control = |b: &u8| *b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c);
    if let Some(offset) = bytes.iter().position(control) {
        return Err(CoordinateError::Binary { offset, byte: bytes[offset] });
    }
    // the dashes are the only signs of Windows-1252 beyond Latin-1 that matter to numbers
    let windows = |b: u8| match b {
        0x96 => '\u{2013}',
        0x97 => '\u{2014}',
        _ => char::from(b),
    };
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&b| windows(b)).collect(),
    })
}

/// The name of a text format that is given by mistake.
fn foreign(text: &str) -> Option<&'static str> {
    let start = text.trim_start();
    let begins = |mark: &str| start.get(..mark.len()).is_some_and(|s| s.eq_ignore_ascii_case(mark));
    let mut lines = text.lines();
    let first = lines.next().unwrap_or("");
    // the 73rd column of an IGES file names the part of the file
    let iges = |line: &str| line.len() >= 80 && line.is_ascii() && &line[72..73] == "S" && line[73..80].trim() == "1";
    if begins("ISO-10303-21") {
        Some("a STEP file; export the outline as lines of x and y")
    } else if iges(first) {
        Some("an IGES file; export the outline as lines of x and y")
    } else if dxf(text) {
        Some("a DXF drawing; export the outline as lines of x and y")
    } else if begins("<svg") || (begins("<?xml") && start.contains("<svg")) {
        Some("an SVG drawing; export the outline as lines of x and y")
    } else if begins("<!doctype html") || begins("<html") {
        Some("a web page; save the plain coordinate file")
    } else if begins("<?xml") || (begins("<") && start.contains("</")) {
        Some("an XML document; export the outline as lines of x and y")
    } else if start.starts_with('{') || start.starts_with('[') {
        Some("a JSON document; write the outline as lines of x and y")
    } else if begins("solid ") && start.contains("facet") {
        Some("an STL mesh; export the outline as lines of x and y")
    } else if begins("%!PS") {
        Some("a PostScript document")
    } else {
        None
    }
}

/// Whether the first lines that are no comments (code 999) are those of a DXF drawing: code 0, then SECTION.
fn dxf(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty()).take(40);
    while let (Some(code), Some(value)) = (lines.next(), lines.next()) {
        match code {
            "0" => return value == "SECTION",
            "999" => {}
            _ => return false,
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_are_recognised() {
        let text = "Göttingen\n1 0\n0.5 0.1\n";
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        for (mark, bytes) in
            [(&[0xff, 0xfe][..], &little), (&[0xfe, 0xff][..], &big), (&[][..], &little), (&[][..], &big)]
        {
            assert_eq!(decode(&[mark, bytes].concat()).unwrap(), text);
        }
        assert_eq!(decode(&[b"\xef\xbb\xbf", text.as_bytes()].concat()).unwrap(), text);
        assert_eq!(decode(b"G\xf6ttingen\n1 0\n0.5 0.1\n").unwrap(), text);
        assert_eq!(decode(b"M\xfcller\n0 \x960.1\n").unwrap(), "Müller\n0 \u{2013}0.1\n");
    }

    #[test]
    fn foreign_formats_are_named() {
        let iges = format!("{:72}S{:7}\n", "a drawing", 1);
        let cases: [(&[u8], &str); 12] = [
            (b"\x1f\x8b\x08\0", "gzip"),
            (b"PK\x03\x04abc", "zip"),
            (b"%PDF-1.4", "PDF"),
            (b"ISO-10303-21;\nHEADER;\n", "STEP"),
            (iges.as_bytes(), "IGES"),
            (b"  0\nSECTION\n  2\nHEADER\n", "DXF"),
            (b"999\nmade by hand\n0\r\nSECTION\r\n", "DXF"),
            (b"<svg xmlns=\"\">", "SVG"),
            (b"<?xml version=\"1.0\"?>\n<svg>", "SVG"),
            (b"<?xml version=\"1.0\"?>\n<airfoil>", "XML"),
            (b"{\"x\": [1, 0]}", "JSON"),
            (b"[[1, 0], [0.5, 0.1]]", "JSON"),
        ];
        for (bytes, name) in cases {
            let error = decode(bytes).unwrap_err();
            assert!(matches!(error, CoordinateError::Format { format } if format.contains(name)), "{name}: {error}");
        }
        assert!(matches!(decode(b"t\n1 0\n\x00\x01"), Err(CoordinateError::Binary { offset: 6, byte: 0 })));
        assert!(matches!(decode(&vec![b' '; LARGEST_FILE + 1]), Err(CoordinateError::TooLarge { .. })));
        assert!(decode(b"0012\n1 0\n").is_ok());
    }
}
