//! Coordinate files at the command line: what is told, what is asked for, what is refused.

mod common;

use aeroform::section::SectionDefinition;
use common::{aeroform, folder, json, refused, text};
use std::fs;

fn outline(row: impl Fn(f64, f64) -> String) -> String {
    let section = SectionDefinition::parse("naca4412").unwrap().section().unwrap();
    section.points(99).into_iter().map(|[x, y]| row(x, y) + "\n").collect()
}

fn plain(x: f64, y: f64) -> String {
    format!("{x:.7} {y:.7}")
}

#[test]
fn sections_are_read_as_told_and_tell_what_was_done() {
    let folder = folder();
    let (sine, cosine) = 5f64.to_radians().sin_cos();
    let two = format!("two\n{}999. 999.\n{}", outline(plain), outline(|x, y| plain(1.05 + 0.3 * x, 0.3 * y - 0.1)));
    let turned = format!("turned\n{}", outline(|x, y| plain(x * cosine - y * sine, x * sine + y * cosine)));
    let commas = format!("commas\n{}", outline(plain)).replace('.', ",");
    for (name, content) in [("two.dat", two), ("turned.dat", turned), ("commas.dat", commas)] {
        fs::write(folder.path().join(name), content).unwrap();
    }
    let section = |arguments: &[&str]| {
        let all = [&["section", "--json"], arguments].concat();
        let output = aeroform(&all, folder.path());
        assert!(output.status.success(), "{arguments:?} {}", text(&output.stderr));
        (json(&output), text(&output.stderr))
    };
    let number = |value: &serde_json::Value, key: &str| value[key].as_f64().unwrap();
    let (built, told) = section(&["naca4412"]);
    assert_eq!(told, "");
    let area = number(&built, "area");

    let (commas, told) = section(&["commas.dat"]);
    assert!((number(&commas, "area") / area - 1.0).abs() < 1e-4);
    assert!(told.lines().count() == 1 && told.contains("decimal commas read in 99 lines"), "{told}");

    refused(&aeroform(&["section", "two.dat"], folder.path()), &["--element N"]);
    let (flap, told) = section(&["two.dat", "--element", "2"]);
    assert!((number(&flap, "area") / (0.09 * area) - 1.0).abs() < 1e-4);
    assert!(told.contains("element 2 of 2"), "{told}");

    // the frame of the file, and the chord frame where it is asked for
    let (turned, told) = section(&["turned.dat"]);
    assert_eq!(told, "");
    let place = |x: f64, y: f64| x * cosine - y * sine;
    let wanted = place(built["centroid"][0].as_f64().unwrap(), built["centroid"][1].as_f64().unwrap());
    assert!((turned["centroid"][0].as_f64().unwrap() - wanted).abs() < 1e-4);
    let (level, told) = section(&["turned.dat", "--normalize"]);
    assert!(told.contains("normalized: moved by") && told.contains("turned by"), "{told}");
    assert!((number(&level, "thickness") - number(&built, "thickness")).abs() < 1e-4);

    let (fitted, told) = section(&["turned.dat", "--fit-tolerance", "1e-3"]);
    assert!(told.contains("fitted with") && told.contains("at most"), "{told}");
    assert!((7.0..101.0).contains(&number(&fitted, "control_points")));
    let (fitted, told) = section(&["turned.dat", "--control-points", "31"]);
    assert!(told.contains("fitted with 31 control points"), "{told}");
    assert_eq!(number(&fitted, "control_points"), 31.0);
    refused(&aeroform(&["section", "naca0012", "--fit-tolerance", "1e-4"], folder.path()), &["coordinate files only"]);
}

#[test]
fn cases_take_the_same_options_and_tell_of_both_files() {
    let folder = folder();
    let two = format!("two\n{}\n{}", outline(plain), outline(|x, y| plain(1.05 + 0.3 * x, 0.3 * y - 0.1)));
    fs::write(folder.path().join("two.dat"), two).unwrap();
    fs::write(folder.path().join("target.dat"), format!("t\n0.25 0\n{}", outline(plain))).unwrap();
    let case = "name = \"c\"\n[section]\nfile = \"two.dat\"\nelement = 2\nnormalize = true\n\
                [target]\nfile = \"target.dat\"\nfit_tolerance = 1e-4\n\
                [box]\nx = [-0.1, 1.1]\ny = [-0.2, 0.2]\ncontrol_points = [4, 4]\ndegree = [3, 3]\n\
                [variables]\nfree = \"all\"\n[objective]\nminimize = { shape_error = 1.0 }\n";
    fs::write(folder.path().join("c.toml"), case).unwrap();
    let case = aeroform::case::Case::open(folder.path().join("c.toml").to_str().unwrap()).unwrap();
    let told = case.repairs().join("\n");
    for part in
        ["two.dat: element 2 of 2", "two.dat: normalized", "target.dat: 1 point away", "target.dat: fitted with"]
    {
        assert!(told.contains(part), "{part}\n{told}");
    }
    let bad = "name = \"c\"\n[section]\nnaca = \"0012\"\nelement = 2\n[objective]\nminimize = { area = 1.0 }\n";
    fs::write(folder.path().join("bad.toml"), bad).unwrap();
    refused(&aeroform(&["evaluate", "bad.toml"], folder.path()), &["bad.toml:4: section.element"]);
}
