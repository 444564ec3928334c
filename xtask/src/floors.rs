//! Checks that source files inside a crate do not depend on each other in large circles.
//!
//! The dependency graph has a node for each file and an edge for each path that leads from one file
//! to another: `use crate::…`, `use super::…`, and paths in code. A path through a re-export leads to
//! the file that has the item. Comments, strings and tests do not count. Files of a strongly
//! connected component can only be understood together.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Most files of a circle.
const MAX_CIRCLE: usize = 4;

/// The path of a module, without `crate`.
type ModulePath = Vec<String>;

/// A source file: the path of its module, and its text without comments, strings and tests.
struct SourceFile {
    module: ModulePath,
    code: String,
}

/// A word, `::`, or another character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Token<'t> {
    Word(&'t str),
    PathSeparator,
    Other(char),
}

/// Replaces comments and the contents of string literals by nothing.
fn without_comments_and_strings(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = rest.find('\n').map_or("", |end| &rest[end..]);
        } else if rest.starts_with("/*") {
            rest = rest.find("*/").map_or("", |end| &rest[end + 2..]);
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\\"'") {
            // A character literal, not the start of a string.
            rest = &rest[rest[1..].find('\'').map_or(rest.len(), |end| end + 2)..];
        } else if let Some(hashes) = raw_string_hashes(rest, &code) {
            let end = format!("\"{}", "#".repeat(hashes));
            let start = hashes + 2;
            rest = rest[start..].find(&end).map_or("", |at| &rest[start + at + end.len()..]);
        } else if first == '"' {
            rest = after_string(&rest[1..]);
        } else {
            code.push(first);
            rest = &rest[first.len_utf8()..];
        }
    }
    code
}

/// The number of `#` of a raw string that starts here, after `code`.
fn raw_string_hashes(rest: &str, code: &str) -> Option<usize> {
    let is_inside_word = code.ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let after = rest.strip_prefix('r').filter(|_| !is_inside_word)?;
    let hashes = after.len() - after.trim_start_matches('#').len();
    after[hashes..].starts_with('"').then_some(hashes)
}

/// What follows a string literal whose content starts here.
fn after_string(mut rest: &str) -> &str {
    while let Some(at) = rest.find(['"', '\\']) {
        if rest[at..].starts_with('"') {
            return &rest[at + 1..];
        }
        let escaped = rest[at + 1..].chars().next().map_or(0, char::len_utf8);
        rest = &rest[at + 1 + escaped..];
    }
    ""
}

fn tokens(code: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut rest = code;
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let length = if word > 0 {
            tokens.push(Token::Word(&rest[..word]));
            word
        } else if rest.starts_with("::") {
            tokens.push(Token::PathSeparator);
            2
        } else {
            if !first.is_whitespace() {
                tokens.push(Token::Other(first));
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

/// The code without modules that are compiled for tests only.
fn without_test_modules(code: &str) -> String {
    let mut kept = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("#[cfg(") {
        let attribute_end = at + rest[at..].find(")]").map_or(rest.len() - at, |end| end + 2);
        let (attribute, after) = (&rest[at..attribute_end], rest[attribute_end..].trim_start());
        let is_test = tokens(attribute).contains(&Token::Word("test")) && !attribute.contains("not(test");
        let is_module = after.starts_with("mod ") || after.starts_with("pub mod ");
        kept += &rest[..at];
        rest = &rest[attribute_end..];
        if is_test && is_module {
            rest = after_item(rest);
        }
    }
    kept + rest
}

/// What follows an item that ends with `;` or with a block.
fn after_item(code: &str) -> &str {
    let mut depth = 0;
    for (at, c) in code.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ';' => {}
            _ => continue,
        }
        if depth == 0 {
            return &code[at + 1..];
        }
    }
    ""
}

/// Appends the paths of a `use` tree that starts at `at`. Returns the position behind it.
fn use_paths<'t>(
    tokens: &[Token<'t>],
    mut at: usize,
    prefix: &[&'t str],
    paths: &mut Vec<Vec<&'t str>>,
) -> usize {
    let mut path = prefix.to_vec();
    while let Some(token) = tokens.get(at) {
        match token {
            Token::Word("as") => at += 1, // the new name is skipped below
            Token::Word(word) => path.push(word),
            Token::PathSeparator => {}
            Token::Other('{') => {
                at += 1;
                while tokens.get(at).is_some_and(|token| *token != Token::Other('}')) {
                    at = use_paths(tokens, at, &path, paths);
                    at += usize::from(tokens.get(at) == Some(&Token::Other(',')));
                }
                return at + 1;
            }
            Token::Other('*') => {}
            Token::Other(_) => break,
        }
        at += 1;
    }
    paths.push(path);
    at
}

/// The words of the path that starts here.
fn path_at<'t>(tokens: &[Token<'t>]) -> Vec<&'t str> {
    let mut path = Vec::new();
    for pair in tokens.chunks(2) {
        let [Token::Word(word), rest @ ..] = pair else { break };
        path.push(*word);
        if rest != [Token::PathSeparator] {
            break;
        }
    }
    path
}

/// What a file uses.
struct Uses {
    /// The paths of its code, absolute and with the used items at their ends.
    paths: Vec<ModulePath>,
    /// Those of `use` items outside of inline modules: their last names are names of the file, too.
    imports: Vec<ModulePath>,
}

fn uses(file: &SourceFile) -> Uses {
    let tokens = tokens(&file.code);
    let child_modules: Vec<&str> = tokens
        .windows(3)
        .filter_map(|window| match window {
            [Token::Word("mod"), Token::Word(name), Token::Other(';')] => Some(*name),
            _ => None,
        })
        .collect();
    let mut module = file.module.clone();
    // For each open brace, whether it is that of an inline module.
    let mut braces = Vec::new();
    let (mut used, mut at) = (Uses { paths: Vec::new(), imports: Vec::new() }, 0);
    while at < tokens.len() {
        let mut paths = Vec::new();
        let is_import = tokens[at] == Token::Word("use") && module == file.module;
        match &tokens[at..] {
            [Token::Word("mod"), Token::Word(name), Token::Other('{'), ..] => {
                module.push((*name).to_owned());
                braces.push(true);
                at += 3;
            }
            [Token::Word("use"), ..] => at = use_paths(&tokens, at + 1, &[], &mut paths),
            [Token::Word(_), Token::PathSeparator, ..] => {
                let path = path_at(&tokens[at..]);
                at += 2 * path.len() - 1;
                paths.push(path);
            }
            [token, ..] => {
                match token {
                    Token::Other('{') => braces.push(false),
                    Token::Other('}') if braces.pop() == Some(true) => drop(module.pop()),
                    _ => {}
                }
                at += 1;
            }
            [] => {}
        }
        let paths = paths.iter().filter_map(|path| absolute(path, &module, file, &child_modules));
        let paths: Vec<ModulePath> = paths.collect();
        if is_import {
            used.imports.extend_from_slice(&paths);
        }
        used.paths.extend(paths);
    }
    used
}

/// A path from the root of the crate; `None` for paths to other crates and to local names.
fn absolute(path: &[&str], module: &[String], file: &SourceFile, children: &[&str]) -> Option<ModulePath> {
    let (base, rest) = match path {
        ["crate", rest @ ..] => (&[][..], rest),
        ["self", rest @ ..] => (module, rest),
        ["super", ..] => {
            let ups = path.iter().take_while(|word| **word == "super").count();
            (&module[..module.len().checked_sub(ups)?], &path[ups..])
        }
        [first, ..] if children.contains(first) => (&file.module[..], path),
        _ => return None,
    };
    Some(base.iter().cloned().chain(rest.iter().map(|word| (*word).to_owned())).collect())
}

/// Longest chain of re-exports that is followed.
const MAX_REEXPORTS: usize = 8;

/// The files that each file uses, as indices: those that have the items at the ends of its paths.
fn dependencies(files: &[SourceFile]) -> Vec<BTreeSet<usize>> {
    let by_module: BTreeMap<&[String], usize> = files.iter().map(|file| &file.module[..]).zip(0..).collect();
    let uses: Vec<Uses> = files.iter().map(uses).collect();
    let target = |path: &ModulePath| {
        let mut path = path.clone();
        for _ in 0..MAX_REEXPORTS {
            // The longest prefix of a path that is a file's module.
            let (end, file) =
                (0..=path.len()).rev().find_map(|end| Some((end, *by_module.get(&path[..end])?)))?;
            let import = uses[file].imports.iter().find(|import| import.last() == path.get(end));
            match import.filter(|import| import[..] != path[..=end]) {
                Some(import) => path = [&import[..], &path[end + 1..]].concat(),
                None => return Some(file),
            }
        }
        None
    };
    let of_file = |at: usize| uses[at].paths.iter().filter_map(target).filter(|to| *to != at).collect();
    (0..files.len()).map(of_file).collect()
}

/// Which files can be reached from a file.
fn reachable(from: usize, edges: &[BTreeSet<usize>]) -> BTreeSet<usize> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(at) = open.pop() {
        open.extend(edges[at].iter().filter(|to| seen.insert(**to)));
    }
    seen
}

/// The strongly connected components of more than [`MAX_CIRCLE`] files, as lists of module paths.
fn large_circles(files: &[SourceFile]) -> Vec<Vec<String>> {
    let edges = dependencies(files);
    let reached: Vec<BTreeSet<usize>> = (0..files.len()).map(|from| reachable(from, &edges)).collect();
    let component = |at: usize| -> Vec<usize> {
        reached[at].iter().copied().filter(|to| reached[*to].contains(&at)).collect()
    };
    let components: BTreeSet<Vec<usize>> = (0..files.len()).map(component).collect();
    let name = |at: &usize| match files[*at].module.join("::") {
        root if root.is_empty() => "lib".to_owned(),
        module => module,
    };
    let large = components.iter().filter(|component| component.len() > MAX_CIRCLE);
    large.map(|component| component.iter().map(name).collect()).collect()
}

fn source_file(module: ModulePath, text: &str) -> SourceFile {
    SourceFile { module, code: without_test_modules(&without_comments_and_strings(text)) }
}

/// The source files below a folder, without files and folders of tests.
fn source_files(folder: &Path, module: &[String]) -> Vec<SourceFile> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("readable").path();
        let stem = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if stem == "tests" {
            continue;
        }
        let inner: ModulePath = module.iter().cloned().chain([stem.clone()]).collect();
        if path.is_dir() {
            files.extend(source_files(&path, &inner));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let is_folder_file = ["lib", "main", "mod"].contains(&stem.as_str());
            let text = std::fs::read_to_string(&path).expect("text");
            files.push(source_file(if is_folder_file { module.to_vec() } else { inner }, &text));
        }
    }
    files
}

#[test]
fn files_of_a_crate_form_no_large_circles() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let mut edges = 0;
    for entry in std::fs::read_dir(crates).expect("a folder of crates") {
        let sources = entry.expect("readable").path().join("src");
        let files = source_files(&sources, &[]);
        edges += dependencies(&files).iter().map(BTreeSet::len).sum::<usize>();
        let circles = large_circles(&files);
        let place = sources.display();
        assert!(circles.is_empty(), "{place}: files that use each other in a circle: {circles:#?}");
    }
    assert!(edges > 2000, "{edges} edges");
}

/// A ring of files, each of which uses the next in another way.
fn ring(last: &str) -> Vec<SourceFile> {
    [
        ("", "mod a; mod b; mod e; mod f;"),
        ("a", "use crate::b::{self, c::{Item as Other, d}};"),
        ("b", "pub(crate) mod c; pub(crate) mod d; fn f() -> u8 { match d::LIMIT { x => x } }"),
        ("b::c", "use super::Nothing;"),
        ("b::d", "mod inline { use super::super::super::e::Item; }"),
        ("e", "fn f() { crate::f::g::<u8>() }"),
        ("f", last),
    ]
    .map(|(module, text)| {
        source_file(module.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect(), text)
    })
    .into()
}

#[test]
fn a_large_circle_is_noticed() {
    let circle = ["a", "b", "b::c", "b::d", "e", "f"];
    assert_eq!(large_circles(&ring("use super::a::Own;")), [circle]);
    // Without its last link, it is none.
    assert!(large_circles(&ring("")).is_empty());
}

#[test]
fn a_path_through_a_re_export_leads_to_the_file_of_the_item() {
    let files = |user: &str| {
        [("", "mod a; mod b; pub use a::{self, Item}; pub struct Own;"), ("a", ""), ("b", user)].map(
            |(module, text)| {
                let module = module.split("::").filter(|part| !part.is_empty()).map(str::to_owned);
                source_file(module.collect(), text)
            },
        )
    };
    let used_by_b = |user| dependencies(&files(user))[2].iter().copied().collect::<Vec<usize>>();
    assert_eq!(used_by_b("use crate::Item;"), [1]);
    assert_eq!(used_by_b("fn f() { super::a::Item::new() }"), [1]);
    assert_eq!(used_by_b("use crate::Own;"), [0]);
}

#[test]
fn comments_strings_and_tests_are_no_links() {
    for text in [
        "// use crate::a::Own;\n/* crate::a */",
        "const TEXT: &str = \"\\\" crate::a::Own\"; const RAW: &str = r#\"\"crate::a::Own\"#;",
        "const QUOTE: char = '\"'; // crate::a::Own \"",
        "#[cfg(test)]\nmod tests { use crate::a::Own; fn f() { {} } }",
        "#[cfg(all(test, unix))]\nmod tests { use crate::a::Own; }",
        "use other_crate::a::Own; use std::a;",
    ] {
        assert!(large_circles(&ring(text)).is_empty(), "{text}");
    }
    assert_eq!(
        large_circles(&ring("const A: char = '\"'; use crate::a::Own; const B: char = '\"';")).len(),
        1
    );
    assert_eq!(large_circles(&ring("#[cfg(test)]\nmod tests;\nuse crate::a::Own;")).len(), 1);
}
