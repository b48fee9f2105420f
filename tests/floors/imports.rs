//! Finds which file of the crate imports from which, by their tokens: `use` trees and paths in code, with re-exports
//! followed to the definition of a name. It understands enough of Rust for this crate: no names made by macros, and no
//! shadowed modules.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A module such as `campaign::ask::spec`, without the crate. The root is empty.
pub type Module = Vec<String>;

/// A path in a file: `crate::a::b` from the root or, for another crate, as it is written in the file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Named {
    pub path: Vec<String>,
    pub is_ours: bool,
    /// Whether the path is in code that is compiled for unit tests only.
    pub in_test: bool,
    /// The name by which a `pub use` re-exports it.
    handed_on: Option<String>,
}

/// The content of a file.
#[derive(Debug, Default)]
pub struct File {
    /// Name such as `campaign/ask/spec.rs`.
    pub name: String,
    pub named: Vec<Named>,
    /// Modules that the file declares, and modules among them that are for unit tests only.
    children: BTreeSet<String>,
    tests: BTreeSet<String>,
    /// Names that the file imports, each with its path (for this crate, from the root).
    imported: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    /// Names that the file defines.
    defined: BTreeSet<String>,
    /// Words of the file's code, except in `use` and tests.
    words: BTreeSet<String>,
}

/// All files of the crate.
pub struct Crate {
    pub files: BTreeMap<Module, File>,
}

impl Crate {
    /// Reads all sources under a folder.
    pub fn read(root: &Path) -> Self {
        fn walk(folder: &Path, root: &Path, found: &mut Vec<(String, String)>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    walk(&path, root, found);
                } else if path.extension().is_some_and(|e| e == "rs") {
                    let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
                    found.push((name, std::fs::read_to_string(&path).unwrap()));
                }
            }
        }
        let mut found = Vec::new();
        walk(root, root, &mut found);
        Self::of(found.iter().map(|(name, text)| (name.as_str(), text.as_str())))
    }

    /// Reads sources, each with its name from the root.
    pub fn of<'a>(sources: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let mut files = BTreeMap::new();
        for (name, text) in sources {
            let module = module_of(name);
            let tokens: TokenStream = text.parse().unwrap_or_else(|e| panic!("{name}: {e}"));
            let mut file = File { name: name.into(), ..File::default() };
            let mut declared = Vec::new();
            declarations(tokens.clone(), false, &mut declared);
            for (child, in_test) in declared {
                if in_test {
                    file.tests.insert(child.clone());
                }
                file.children.insert(child);
            }
            Reader { file: &mut file, module: module.clone(), in_test: false }.read(tokens);
            files.insert(module, file);
        }
        Self { files }
    }

    /// Whether a file is compiled for unit tests only.
    pub fn is_test(&self, module: &[String]) -> bool {
        (0..module.len()).any(|k| self.files.get(&module[..k]).is_some_and(|file| file.tests.contains(&module[k])))
    }

    /// The file in which the item of a path is defined. It is None if the item is not in this crate.
    pub fn made_in(&self, path: &[String]) -> Option<&Module> {
        self.follow(path, 0)
    }

    fn follow(&self, path: &[String], depth: usize) -> Option<&Module> {
        let known = (0..=path.len()).rev().find(|&k| self.files.contains_key(&path[..k]))?;
        let (module, file) = self.files.get_key_value(&path[..known])?;
        let Some(name) = path.get(known).filter(|name| !file.defined.contains(*name) && depth < 9) else {
            return Some(module);
        };
        if let Some(from) = file.imported.get(name) {
            return self.follow(&[from, &path[known + 1..]].concat(), depth + 1);
        }
        let defines = |from: &&Vec<String>| self.files.get(*from).is_some_and(|file| file.defined.contains(name));
        match file.globs.iter().find(defines) {
            Some(from) => self.files.get_key_value(from).map(|(module, _)| module),
            None => Some(module),
        }
    }

    /// For each file that is no unit test, the other files that it uses outside of its tests.
    pub fn uses(&self) -> BTreeMap<&Module, BTreeSet<&Module>> {
        let mut uses = BTreeMap::new();
        for (module, file) in self.files.iter().filter(|(module, _)| !self.is_test(module)) {
            let is_used = |named: &&Named| {
                // A name that is only re-exported is not used here.
                let handed_on = named.handed_on.as_ref().is_some_and(|name| !file.words.contains(name));
                named.is_ours && !named.in_test && !handed_on
            };
            let made_in = file.named.iter().filter(is_used).filter_map(|named| self.made_in(&named.path));
            uses.insert(module, made_in.filter(|other| *other != module).collect());
        }
        uses
    }

    /// Groups of files that form import circles, each with the uses within the group.
    pub fn circles(&self) -> Vec<String> {
        let uses = self.uses();
        let reach: BTreeMap<_, _> = uses.keys().map(|module| (*module, reached(&uses, module))).collect();
        let mut groups: BTreeSet<Vec<&Module>> = BTreeSet::new();
        for (module, reached) in reach.iter().filter(|(module, reached)| reached.contains(*module)) {
            groups.insert(reached.iter().filter(|other| reach[*other].contains(module)).copied().collect());
        }
        let name = |module: &Module| self.files[module].name.as_str();
        let told = |group: Vec<&Module>| {
            let within = |module: &&Module| {
                let others = uses[*module].iter().filter(|other| group.contains(other)).map(|other| name(other));
                format!("{} -> {}", name(module), others.collect::<Vec<_>>().join(", "))
            };
            format!("a circle: {}", group.iter().map(within).collect::<Vec<_>>().join("; "))
        };
        groups.into_iter().map(told).collect()
    }
}

/// All files that a file uses, directly or through others.
fn reached<'a>(uses: &BTreeMap<&'a Module, BTreeSet<&'a Module>>, from: &'a Module) -> BTreeSet<&'a Module> {
    let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(module) = next.pop() {
        next.extend(uses[module].iter().filter(|other| uses.contains_key(*other) && seen.insert(**other)));
    }
    seen
}

/// `a/b.rs` and `a/b/mod.rs` are the module `a::b`, and `lib.rs` is the root.
fn module_of(name: &str) -> Module {
    let name = name.trim_end_matches(".rs").trim_end_matches("/mod");
    if name == "lib" { Module::new() } else { name.split('/').map(String::from).collect() }
}

fn ident(token: Option<&TokenTree>) -> Option<String> {
    match token {
        Some(TokenTree::Ident(ident)) => Some(ident.to_string()),
        _ => None,
    }
}

fn is_punct(token: Option<&TokenTree>, c: char) -> bool {
    matches!(token, Some(TokenTree::Punct(punct)) if punct.as_char() == c)
}

/// Whether there is a `::` at a position.
fn is_separator(tokens: &[TokenTree], at: usize) -> bool {
    is_punct(tokens.get(at), ':') && is_punct(tokens.get(at + 1), ':')
}

/// The end of an item that starts at a position: after its braces or its semicolon.
fn item_end(tokens: &[TokenTree], from: usize) -> usize {
    let ends = |token: &TokenTree| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        other => is_punct(Some(other), ';'),
    };
    // The attributes that follow belong to the item; `use a::{b};` ends with its semicolon.
    let end = from + tokens[from..].iter().position(ends).map_or(tokens.len() - from, |at| at + 1);
    if is_punct(tokens.get(end), ';') { end + 1 } else { end }
}

/// Whether there is a `#[cfg(test)]`, or another condition with `test`, at a position.
fn is_for_tests(tokens: &[TokenTree], at: usize) -> bool {
    let Some(TokenTree::Group(group)) = tokens.get(at + 1).filter(|_| is_punct(tokens.get(at), '#')) else {
        return false;
    };
    let condition: Vec<String> = group.to_string().split(|c: char| !c.is_alphanumeric()).map(String::from).collect();
    condition.iter().any(|word| word == "cfg") && condition.iter().any(|word| word == "test")
}

/// Modules in files of their own (`mod name;`), each with whether it is for tests only.
fn declarations(tokens: TokenStream, in_test: bool, found: &mut Vec<(String, bool)>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    while at < tokens.len() {
        if is_for_tests(&tokens, at) {
            let end = item_end(&tokens, at + 2);
            declarations(tokens[at + 2..end].iter().cloned().collect(), true, found);
            at = end;
            continue;
        }
        if let (Some("mod"), Some(name)) = (ident(tokens.get(at)).as_deref(), ident(tokens.get(at + 1)))
            && is_punct(tokens.get(at + 2), ';')
        {
            found.push((name, in_test));
        }
        at += 1;
    }
}

struct Reader<'a> {
    file: &'a mut File,
    /// The module of the file, with the names of inline modules around the present place.
    module: Module,
    in_test: bool,
}

impl Reader<'_> {
    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while at < tokens.len() {
            if is_for_tests(&tokens, at) && !self.in_test {
                let end = item_end(&tokens, at + 2);
                self.in_test = true;
                self.read(tokens[at + 2..end].iter().cloned().collect());
                self.in_test = false;
                at = end;
                continue;
            }
            at = match &tokens[at] {
                TokenTree::Group(group) => {
                    self.read(group.stream());
                    at + 1
                }
                TokenTree::Ident(word) => self.word(&word.to_string(), &tokens, at),
                _ => at + 1,
            };
        }
    }

    /// Reads the code that begins with a word, and returns the position at which to continue.
    fn word(&mut self, word: &str, tokens: &[TokenTree], at: usize) -> usize {
        let next = ident(tokens.get(at + 1));
        match (word, &next, tokens.get(at + 2)) {
            ("use", _, _) => {
                let end = at + tokens[at..].iter().position(|t| is_punct(Some(t), ';')).unwrap_or(tokens.len() - at);
                let is_public = match at.checked_sub(1).map(|before| &tokens[before]) {
                    Some(TokenTree::Ident(word)) => word == "pub",
                    Some(TokenTree::Group(group)) => group.delimiter() == Delimiter::Parenthesis,
                    _ => false,
                };
                self.tree(&tokens[at + 1..end], &[], is_public);
                return end + 1;
            }
            ("mod", Some(name), Some(TokenTree::Group(group))) => {
                self.module.push(name.clone());
                self.read(group.stream());
                self.module.pop();
                return at + 3;
            }
            ("struct" | "enum" | "union" | "trait" | "type" | "const" | "static" | "fn", Some(name), _)
                if !self.in_test =>
            {
                self.file.defined.insert(name.clone());
            }
            _ => {}
        }
        let mut path = vec![word.to_string()];
        let mut end = at + 1;
        while let Some(name) = ident(tokens.get(end + 2)).filter(|_| is_separator(tokens, end)) {
            path.push(name);
            end += 3;
        }
        if !self.in_test {
            self.file.words.extend(path.iter().cloned());
        }
        let is_rest = at >= 2 && is_separator(tokens, at - 2) || at >= 1 && is_punct(tokens.get(at - 1), '.');
        if path.len() > 1 && !is_rest {
            self.name(path, None);
        }
        end
    }

    /// Reads a `use` tree after its `prefix`.
    fn tree(&mut self, tokens: &[TokenTree], prefix: &[String], is_public: bool) {
        let (mut path, mut at) = (prefix.to_vec(), 0);
        loop {
            match tokens.get(at) {
                Some(TokenTree::Ident(name)) if name == "as" => {
                    let alias = ident(tokens.get(at + 1));
                    return self.import(path, alias, is_public);
                }
                Some(TokenTree::Ident(name)) => path.push(name.to_string()),
                Some(TokenTree::Group(group)) => {
                    let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                    inner.split(|t| is_punct(Some(t), ',')).for_each(|branch| {
                        if !branch.is_empty() {
                            self.tree(branch, &path, is_public);
                        }
                    });
                    return;
                }
                Some(TokenTree::Punct(punct)) if punct.as_char() == '*' => {
                    let (from, is_ours) = self.absolute(path.clone());
                    if is_ours && !self.in_test {
                        self.file.globs.push(from);
                    }
                    return self.name(path, None);
                }
                Some(_) => {}
                None => return self.import(path, None, is_public),
            }
            at += 1;
        }
    }

    fn import(&mut self, mut path: Vec<String>, alias: Option<String>, is_public: bool) {
        if path.len() > 1 && path.last().is_some_and(|name| name == "self") {
            path.pop();
        }
        let name = alias.or_else(|| path.last().cloned()).unwrap_or_default();
        let (from, is_ours) = self.absolute(path.clone());
        if is_ours && !self.in_test {
            self.file.imported.insert(name.clone(), from);
        }
        self.name(path, is_public.then_some(name));
    }

    fn name(&mut self, path: Vec<String>, handed_on: Option<String>) {
        let (path, is_ours) = self.absolute(path);
        self.file.named.push(Named { path, is_ours, in_test: self.in_test, handed_on });
    }

    /// A path from the root, and whether it is in this crate.
    fn absolute(&self, path: Vec<String>) -> (Vec<String>, bool) {
        let above = path.iter().take_while(|name| *name == "super").count();
        let is_main = self.file.name == "main.rs";
        let (base, rest) = match path[0].as_str() {
            "crate" if is_main => return (path, false),
            "crate" => (Vec::new(), 1),
            "standfast" if is_main => (Vec::new(), 1),
            "super" => (self.module[..self.module.len().saturating_sub(above)].to_vec(), above),
            "self" => (self.module.clone(), 1),
            first if self.file.children.contains(first) => (self.module.clone(), 0),
            _ => return (path, false),
        };
        ([&base[..], &path[rest..]].concat(), true)
    }
}
