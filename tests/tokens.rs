//! The size of each crate in tokens, product and tests apart, against the budgets in `tests/tokens.toml`. Formatting and
//! comments do not count. A commit that raises a budget says what a user gets for it.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Number of tokens by which a budget may exceed the count before it has to be lowered.
const MOST_SPARE: usize = 500;

/// Number of tokens of a crate.
#[derive(Debug, Default, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Size {
    product: usize,
    tests: usize,
}

/// Adds the tokens of a stream to `size`. Those of an item for `cfg(test)` are of the tests.
fn count(stream: TokenStream, is_test: bool, size: &mut Size) {
    let mut tokens = stream.into_iter().peekable();
    let mut is_test_item = false;
    while let Some(token) = tokens.next() {
        let mut text = String::new();
        if matches!(&token, TokenTree::Punct(punct) if punct.as_char() == '#') {
            // An attribute of the file has a `!` between.
            tokens
                .next_if(|next| matches!(next, TokenTree::Punct(punct) if punct.as_char() == '!'));
            text = tokens.peek().map(ToString::to_string).unwrap_or_default();
        }
        if text.starts_with("[doc =") {
            tokens.next();
            continue;
        }
        is_test_item |= text == "[cfg (test)]";
        let in_tests = is_test || is_test_item;
        let is_end = match &token {
            TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
            TokenTree::Punct(punct) => punct.as_char() == ';',
            _ => false,
        };
        let own = match token {
            TokenTree::Group(group) => {
                count(group.stream(), in_tests, size);
                2
            }
            _ => 1,
        };
        *(if in_tests {
            &mut size.tests
        } else {
            &mut size.product
        }) += own;
        is_test_item &= !is_end;
    }
}

/// Adds the files below a folder to `size`, without folders that are crates of their own.
fn count_folder(folder: &Path, is_test: bool, size: &mut Size) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let is_test = is_test || ["tests", "tests.rs", "fixtures.rs"].contains(&name);
        if path.is_dir() && !path.join("Cargo.toml").exists() {
            count_folder(&path, is_test, size);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let stream = text
                .parse()
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            count(stream, is_test, size);
        }
    }
}

/// The sizes of all crates by their folders.
fn sizes(root: &Path) -> BTreeMap<String, Size> {
    let mut sizes = BTreeMap::new();
    let mut program = Size::default();
    count_folder(&root.join("src"), false, &mut program);
    count_folder(&root.join("tests"), true, &mut program);
    count_folder(&root.join("benches/layers"), true, &mut program);
    sizes.insert("program".to_string(), program);
    let members = fs::read_dir(root.join("src"))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    for folder in members
        .chain([root.join("benches/paper")])
        .filter(|folder| folder.join("Cargo.toml").exists())
    {
        let mut size = Size::default();
        count_folder(&folder, false, &mut size);
        sizes.insert(
            folder.file_name().unwrap().to_str().unwrap().to_string(),
            size,
        );
    }
    sizes
}

#[test]
fn every_crate_is_within_its_budget() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let budgets: BTreeMap<String, Size> = toml::from_str(include_str!("tokens.toml")).unwrap();
    let sizes = sizes(root);
    let fits = |count: usize, budget: usize| count <= budget && budget <= count + MOST_SPARE;
    let is_within = sizes.len() == budgets.len()
        && sizes.iter().all(|(name, size)| {
            budgets.get(name).is_some_and(|budget| {
                fits(size.product, budget.product) && fits(size.tests, budget.tests)
            })
        });
    let mut table = String::new();
    for (name, Size { product, tests }) in &sizes {
        table += &format!("{name} = {{ product = {product}, tests = {tests} }}\n");
    }
    assert!(
        is_within,
        "a crate exceeds its budget, or a budget its crate by more than {MOST_SPARE} tokens: the counts are\n{table}"
    );
}

#[test]
fn comments_and_formatting_do_not_count_and_tests_count_apart() {
    let text = "//! A file.\n/// A function.\nfn f(x: u8) -> u8 {\n    // Nothing.\n    x\n}\n";
    let mut size = Size::default();
    count(text.parse().unwrap(), false, &mut size);
    assert_eq!(
        size,
        Size {
            product: 13,
            tests: 0
        }
    );
    count(
        "#[cfg(test)] mod tests { fn g() {} } use a;"
            .parse()
            .unwrap(),
        false,
        &mut size,
    );
    assert_eq!(
        size,
        Size {
            product: 13 + 3,
            tests: 17
        }
    );
}
