//! Who imports whom: modules only those that stand above them in the picture of the guide, files never in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// A path as its segments.
type Segments = Vec<String>;

/// One source file, without comments, literals and tests.
struct Source {
    /// Path below `src`, for messages.
    name: String,
    /// Path of the module from the root of the crate.
    module: Segments,
    tokens: Vec<String>,
}

/// A name that a `use` brings into a module.
struct Import {
    /// Whether other modules can take it from there.
    reexported: bool,
    path: Segments,
    alias: String,
}

/// The text without comments, strings and characters, which could hold anything.
fn without_literals(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or(' ');
    let mut result = String::new();
    let mut i = 0;
    while i < chars.len() {
        let raw = at(i) == 'r' && matches!(at(i + 1), '"' | '#') && !(i > 0 && at(i - 1).is_alphanumeric());
        if at(i) == '/' && at(i + 1) == '/' {
            while i < chars.len() && at(i) != '\n' {
                i += 1;
            }
        } else if raw {
            let hashes = (1..).take_while(|k| at(i + k) == '#').count();
            i += hashes + 2;
            while i < chars.len() && !(at(i) == '"' && (1..=hashes).all(|k| at(i + k) == '#')) {
                i += 1;
            }
            i += hashes + 1;
        } else if at(i) == '"' {
            i += 1;
            while i < chars.len() && at(i) != '"' {
                i += if at(i) == '\\' { 2 } else { 1 };
            }
            i += 1;
        } else if at(i) == '\'' && at(i + 1) == '\\' {
            i += 3;
            while i < chars.len() && at(i) != '\'' {
                i += 1;
            }
            i += 1;
        } else if at(i) == '\'' && at(i + 2) == '\'' {
            i += 3;
        } else {
            result.push(at(i));
            i += 1;
        }
    }
    result
}

/// Identifiers, `::` and single signs.
fn tokens(text: &str) -> Vec<String> {
    let mut result: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        if c.is_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        if !word.is_empty() {
            result.push(std::mem::take(&mut word));
        }
        if c == ':' && chars.next_if_eq(&':').is_some() {
            result.push("::".into());
        } else if !c.is_whitespace() {
            result.push(c.into());
        }
    }
    result
}

/// The end of the item that begins at `start`: behind its semicolon, or its braces.
fn item_end(tokens: &[String], start: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(start) {
        match token.as_str() {
            "{" | "(" | "[" => depth += 1,
            ")" | "]" => depth -= 1,
            "}" => {
                depth -= 1;
                if depth == 0 {
                    return i + 1;
                }
            }
            ";" if depth == 0 => return i + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// Leaves out items that exist in tests only.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let marker = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut result = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i..].len() >= marker.len() && tokens[i..].iter().zip(marker).all(|(token, mark)| token == mark) {
            i = item_end(&tokens, i + marker.len());
        } else {
            result.push(tokens[i].clone());
            i += 1;
        }
    }
    result
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// All paths of a `use` tree that begins at `*at`, which is moved behind it.
fn use_tree(tokens: &[String], at: &mut usize, prefix: &[String], found: &mut Vec<(Segments, String)>) {
    let mut path = prefix.to_vec();
    while *at < tokens.len() {
        match tokens[*at].as_str() {
            "::" => *at += 1,
            "{" => {
                *at += 1;
                while tokens[*at] != "}" {
                    use_tree(tokens, at, &path, found);
                    if tokens[*at] == "," {
                        *at += 1;
                    }
                }
                *at += 1;
                return;
            }
            "as" => {
                found.push((path, tokens[*at + 1].clone()));
                *at += 2;
                return;
            }
            "," | "}" | ";" => break,
            word => {
                if word != "self" || path.is_empty() {
                    path.push(word.into());
                }
                *at += 1;
            }
        }
    }
    let alias = path.last().cloned().unwrap_or_default();
    found.push((path, alias));
}

impl Source {
    /// Reads a file of `src`; `None` for files that exist in tests only.
    fn read(root: &Path, path: &Path) -> Option<Self> {
        let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
        let mut module: Segments = name.trim_end_matches(".rs").split('/').map(String::from).collect();
        let last = module.last().unwrap().as_str();
        if last.ends_with("tests") || ["testing", "testcases", "main"].contains(&last) {
            return None;
        }
        if ["mod", "lib"].contains(&last) {
            module.pop();
        }
        if name.starts_with("guide/") {
            return None; // text alone
        }
        let tokens = without_tests(tokens(&without_literals(&fs::read_to_string(path).unwrap())));
        Some(Self { name, module, tokens })
    }

    /// Names brought in by `use`, and the paths written out elsewhere.
    fn paths(&self) -> (Vec<Import>, Vec<Segments>) {
        let (mut imports, mut inline) = (Vec::new(), Vec::new());
        let mut i = 0;
        while i < self.tokens.len() {
            if self.tokens[i] == "use" && !(i > 0 && self.tokens[i - 1] == "+") {
                // (`+ use<…>` is a bound)
                let reexported = i > 0 && ["pub", ")"].contains(&self.tokens[i - 1].as_str());
                let mut found = Vec::new();
                i += 1;
                use_tree(&self.tokens, &mut i, &[], &mut found);
                imports.extend(found.into_iter().map(|(path, alias)| Import { reexported, path, alias }));
            } else if is_word(&self.tokens[i]) && self.tokens.get(i + 1).is_some_and(|t| t == "::") {
                let mut path = vec![self.tokens[i].clone()];
                i += 1;
                while self.tokens.get(i).is_some_and(|t| t == "::") && is_word(self.tokens.get(i + 1).map_or("", |t| t))
                {
                    path.push(self.tokens[i + 1].clone());
                    i += 2;
                }
                inline.push(path);
            } else {
                i += 1;
            }
        }
        (imports, inline)
    }
}

/// All source files by their modules.
struct Sources {
    files: BTreeMap<Segments, Source>,
    imports: BTreeMap<Segments, Vec<Import>>,
}

impl Sources {
    fn read() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let (mut files, mut folders) = (BTreeMap::new(), vec![root.clone()]);
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "rs")
                    && let Some(source) = Source::read(&root, &path)
                {
                    files.insert(source.module.clone(), source);
                }
            }
        }
        let imports = files.iter().map(|(module, source)| (module.clone(), source.paths().0)).collect();
        Self { files, imports }
    }

    /// The path from the root of the crate; `None` where it leads out of the crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Segments> {
        let mut base = module.to_vec();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => (base, rest) = (Vec::new(), &path[1..]),
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|s| s == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            child => {
                base.push(child.into());
                if !self.files.contains_key(&base) {
                    return None;
                }
                rest = &path[1..];
            }
        }
        Some(base.into_iter().chain(rest.iter().cloned()).collect())
    }

    /// The module whose file defines what a path from the root names: names that are handed on are followed.
    fn definition(&self, path: &[String], depth: usize) -> Option<Segments> {
        assert!(depth < 20, "{path:?} is handed on in a circle");
        let known = (0..=path.len()).rev().find(|&n| self.files.contains_key(&path[..n]))?;
        let (module, rest) = path.split_at(known);
        if let Some(name) = rest.first()
            && let Some(import) = self.imports[module].iter().find(|i| i.reexported && i.alias == *name)
            && let Some(mut further) = self.absolute(module, &import.path)
        {
            further.extend_from_slice(&rest[1..]);
            return self.definition(&further, depth + 1);
        }
        Some(module.to_vec())
    }

    /// The modules that the file of a module needs. What it hands on without using is no need of its own.
    fn needs(&self, module: &Segments) -> BTreeSet<Segments> {
        let source = &self.files[module];
        let (imports, inline) = source.paths();
        let used = |name: &str| source.tokens.iter().filter(|t| *t == name).count() > 1;
        let taken = imports.into_iter().filter(|i| !i.reexported || used(&i.alias)).map(|i| i.path);
        taken
            .chain(inline)
            .filter_map(|path| self.definition(&self.absolute(module, &path)?, 0))
            .filter(|found| found != module && !found.is_empty())
            .collect()
    }

    /// Every need of every file but the root of the crate, by their names.
    fn all_needs(&self) -> BTreeMap<&Segments, BTreeSet<Segments>> {
        self.files.keys().filter(|module| !module.is_empty()).map(|module| (module, self.needs(module))).collect()
    }

    fn name(&self, module: &Segments) -> &str {
        &self.files[module].name
    }
}

/// The rows of a picture of the guide, from above.
fn rows(picture: &str) -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/guide/architecture.md");
    let text = fs::read_to_string(path).unwrap();
    let (_, begin) = text.split_once(&format!("<svg id=\"{picture}\"")).expect("the picture");
    let (svg, _) = begin.split_once("</svg>").expect("its end");
    let labels = svg.split("<text class=\"modules\"").skip(1);
    let label = |rest: &str| rest.split_once('>').unwrap().1.split_once('<').unwrap().0.to_string();
    labels.map(|rest| label(rest).split(" · ").map(String::from).collect()).collect()
}

/// Every module below `folder` that imports one which stands below it in the picture, and modules missing there.
fn out_of_order(sources: &Sources, folder: &[&str], rows: &[Vec<String>]) -> Vec<String> {
    let depth = folder.len();
    let inside = |module: &Segments| module.len() > depth && module.iter().zip(folder).all(|(a, b)| a == b);
    let row = |module: &Segments| rows.iter().position(|row| row.contains(&module[depth]));
    let mut faults = BTreeSet::new();
    for name in rows.iter().flatten() {
        let module: Segments = folder.iter().map(ToString::to_string).chain([name.clone()]).collect();
        if !sources.files.contains_key(&module) {
            faults.insert(format!("{name} stands in the picture and is no module"));
        }
    }
    for (module, needs) in sources.all_needs() {
        if !inside(module) {
            continue;
        }
        let Some(own) = row(module) else {
            faults.insert(format!("{} stands nowhere in the picture", module[depth]));
            continue;
        };
        for need in needs.iter().filter(|need| inside(need)) {
            if row(need).is_none_or(|row| row > own) {
                faults.insert(format!("{} needs {}", sources.name(module), sources.name(need)));
            }
        }
    }
    faults.into_iter().collect()
}

#[test]
fn modules_need_only_those_above_them() {
    let rows = rows("modules");
    assert!(rows.len() > 10, "{rows:?}");
    let faults = out_of_order(&Sources::read(), &[], &rows);
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn the_layer_needs_no_outer_flow_and_the_search_no_solver() {
    let rows = rows("flow");
    assert!(rows.len() > 5, "{rows:?}");
    let faults = out_of_order(&Sources::read(), &["flow"], &rows);
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Groups of files each of which needs all others of its group, by way of others or directly.
fn circles(sources: &Sources) -> BTreeSet<String> {
    let needs = sources.all_needs();
    let reach = |start: &Segments| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start.clone()]);
        while let Some(module) = open.pop() {
            open.extend(needs[&module].iter().filter(|need| seen.insert((*need).clone())).cloned());
        }
        seen
    };
    let reached: BTreeMap<&Segments, BTreeSet<Segments>> =
        needs.keys().map(|module| (*module, reach(module))).collect();
    let group = |module: &Segments| {
        let mutual = reached[module].iter().filter(|other| reached[other].contains(module));
        mutual.map(|other| sources.name(other)).collect::<Vec<_>>().join(", ")
    };
    needs.keys().map(|module| group(module)).filter(|group| !group.is_empty()).collect()
}

#[test]
fn no_files_need_each_other_in_a_circle() {
    let found = circles(&Sources::read());
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_scan_sees_what_it_should() {
    let sources = Sources::read();
    let path = |text: &str| text.split("::").map(String::from).collect::<Segments>();
    // a name handed on by two modules, one in braces, a path written out, a module by its name
    assert_eq!(sources.definition(&path("flow::TrailingEdge"), 0).map(|m| sources.name(&m)), Some("section/curve.rs"));
    assert!(sources.needs(&path("flow::panel::family")).contains(&path("flow::search::newton")));
    assert!(sources.needs(&path("flow::panel::coupling::speeds")).contains(&path("flow::panel::coupling::projection")));
    assert!(sources.needs(&path("flow::panel::coupling::response")).contains(&path("scalar")));
    assert!(sources.all_needs().values().map(BTreeSet::len).sum::<usize>() > 500);
    let text = "use a::{b, c::{self, d as e}}; /* no */ '\"' \"use x::y\" 'a' fn f<'a>() {}";
    assert!(!tokens(&without_literals(text)).contains(&"x".into()));
    let text = "#[cfg(test)] mod tests { use crate::cli::x; } use crate::scalar::Scalar;";
    assert!(!without_tests(tokens(text)).contains(&"cli".into()));
}
