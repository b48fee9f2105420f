//! The code of a TorchScript file: a small part of Python, in which each line is an assignment, a call, an `if` or a
//! `return`. Other statements are kept as such, so that they are refused only where `forward` comes to them.

use std::collections::HashMap;
use std::rc::Rc;

/// Largest depth of brackets, and of blocks.
const MOST_DEPTH: usize = 60;

pub enum Expr {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(Rc<str>),
    Name(Rc<str>),
    /// `object.name`
    Dot(Box<Expr>, Rc<str>),
    /// Arguments may have names.
    Call(Box<Expr>, Vec<(Option<Rc<str>>, Expr)>),
    /// `list[place]`
    At(Box<Expr>, Box<Expr>),
    /// A list or a tuple.
    List(Vec<Expr>),
}

pub enum Statement {
    /// `target = value`; a target may be a list of names.
    Set(Expr, Expr),
    Do(Expr),
    If(Expr, Vec<Statement>, Vec<Statement>),
    Return(Expr),
    /// Any other statement, in words.
    Other(String),
}

pub struct Parameter {
    pub name: Rc<str>,
    pub kind: Option<Expr>,
    pub default: Option<Expr>,
}

pub struct Function {
    pub parameters: Vec<Parameter>,
    pub body: Vec<Statement>,
}

/// The functions of a file: `NAME`, and `CLASS.NAME` for the methods of a class.
pub type Functions = HashMap<String, Rc<Function>>;

/// Reads a file of code. Errors are in words.
pub fn read(text: &str) -> Result<Functions, String> {
    let lines = lines(text)?;
    let (mut functions, mut class, mut at) = (Functions::new(), None, 0);
    while at < lines.len() {
        let line = &lines[at];
        if line.indent == 0 {
            class = None;
        }
        let mut parser = Parser::of(line);
        at += 1;
        if parser.takes("class") {
            class = Some(parser.name()?);
        } else if parser.takes("def") {
            let name = parser.name()?;
            let parameters = parser.parameters()?;
            let body = block(&lines, &mut at, line.indent, 0)?;
            let name = match &class {
                Some(class) => format!("{class}.{name}"),
                None => name.to_string(),
            };
            let function = Function { parameters, body };
            functions.insert(name, Rc::new(function));
        }
    }
    Ok(functions)
}

/// The statements of the lines that are indented by more than `indent`.
fn block(
    lines: &[Line],
    at: &mut usize,
    indent: usize,
    depth: usize,
) -> Result<Vec<Statement>, String> {
    let mut statements = Vec::new();
    while let Some(line) = lines.get(*at).filter(|line| line.indent > indent) {
        if depth > MOST_DEPTH {
            return Err(format!(
                "line {}: more than {MOST_DEPTH} blocks in each other",
                line.number
            ));
        }
        *at += 1;
        let parsed = Parser::of(line).statement();
        let inner = block(lines, at, line.indent, depth + 1)?;
        statements.push(match parsed {
            Ok(Some(Statement::If(condition, ..))) => {
                let mut otherwise = Vec::new();
                if let Some(next) = lines.get(*at)
                    && next.indent == line.indent
                    && next.tokens.first() == Some(&Token::Name("else".into()))
                {
                    *at += 1;
                    otherwise = block(lines, at, line.indent, depth + 1)?;
                }
                Statement::If(condition, inner, otherwise)
            }
            Ok(Some(statement)) => statement,
            Ok(None) => continue,
            Err(problem) => Statement::Other(problem),
        });
    }
    Ok(statements)
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Name(Rc<str>),
    Number(Rc<str>),
    Text(Rc<str>),
    Sign(char),
}

/// A line, with those that go on in its brackets.
struct Line {
    number: usize,
    indent: usize,
    tokens: Vec<Token>,
}

fn lines(text: &str) -> Result<Vec<Line>, String> {
    let (mut lines, mut open) = (Vec::<Line>::new(), 0_usize);
    for (number, line) in text.lines().enumerate() {
        let rest = line.trim_start();
        if rest.is_empty() || rest.starts_with('#') {
            continue;
        }
        let number = number + 1;
        if open == 0 {
            let indent = line.len() - rest.len();
            let tokens = Vec::new();
            lines.push(Line {
                number,
                indent,
                tokens,
            });
        }
        let tokens = &mut lines.last_mut().expect("one was pushed").tokens;
        let from = tokens.len();
        push_tokens(rest, tokens).map_err(|problem| format!("line {number}: {problem}"))?;
        for token in &tokens[from..] {
            match token {
                Token::Sign('(' | '[' | '{') => open += 1,
                Token::Sign(')' | ']' | '}') => open = open.saturating_sub(1),
                _ => {}
            }
        }
    }
    Ok(lines)
}

fn push_tokens(line: &str, tokens: &mut Vec<Token>) -> Result<(), String> {
    let mut chars = line.chars().peekable();
    while let Some(first) = chars.next() {
        let mut word = String::from(first);
        if first.is_alphabetic() || first == '_' {
            while let Some(next) = chars.next_if(|next| next.is_alphanumeric() || *next == '_') {
                word.push(next);
            }
            tokens.push(Token::Name(word.into()));
        } else if first.is_ascii_digit() {
            while let Some(next) = chars.next_if(|next| {
                next.is_alphanumeric()
                    || *next == '.'
                    || "+-".contains(*next) && word.ends_with('e')
            }) {
                word.push(next);
            }
            tokens.push(Token::Number(word.into()));
        } else if first == '"' || first == '\'' {
            word.clear();
            loop {
                match chars.next().ok_or("a text without an end")? {
                    end if end == first => break,
                    '\\' => word.push(chars.next().ok_or("a text without an end")?),
                    other => word.push(other),
                }
            }
            tokens.push(Token::Text(word.into()));
        } else if first == '#' {
            break;
        } else if !first.is_whitespace() {
            tokens.push(Token::Sign(first));
        }
    }
    Ok(())
}

struct Parser<'a> {
    tokens: &'a [Token],
    line: usize,
    depth: usize,
}

impl<'a> Parser<'a> {
    fn of(line: &'a Line) -> Self {
        Self {
            tokens: &line.tokens,
            line: line.number,
            depth: 0,
        }
    }

    /// The statement of a line, which for `if` is that of its first line. It is None for `pass`.
    fn statement(&mut self) -> Result<Option<Statement>, String> {
        /// First words of statements that are not taken.
        const OTHERS: [&str; 8] = [
            "assert", "def", "del", "elif", "else", "for", "raise", "while",
        ];
        if let Some(Token::Name(word)) = self.tokens.first()
            && OTHERS.contains(&&**word)
        {
            return Err(format!("line {}: a statement `{word}`", self.line));
        }
        let statement = if self.takes("pass") {
            None
        } else if self.takes("if") {
            let condition = self.expr()?;
            self.expect(":")?;
            Some(Statement::If(condition, Vec::new(), Vec::new()))
        } else if self.takes("return") {
            Some(Statement::Return(self.exprs()?))
        } else {
            let first = self.exprs()?;
            // The type of what is set.
            if self.takes(":") {
                self.expr()?;
            }
            Some(match self.takes("=") {
                true => Statement::Set(first, self.exprs()?),
                false => Statement::Do(first),
            })
        };
        match self.tokens {
            [] => Ok(statement),
            _ => self.fail(),
        }
    }

    fn fail<T>(&self) -> Result<T, String> {
        let what = match self.tokens.first() {
            None => "the end of the line".to_string(),
            Some(Token::Name(text) | Token::Number(text) | Token::Text(text)) => {
                format!("{text:.40?}")
            }
            Some(Token::Sign(sign)) => format!("{sign:?}"),
        };
        Err(format!("line {}: {what} is not expected here", self.line))
    }

    /// Whether the next token is this word or sign, which is then taken.
    fn takes(&mut self, word: &str) -> bool {
        let is_it = match self.tokens.first() {
            Some(Token::Name(name)) => **name == *word,
            Some(Token::Sign(sign)) => word.len() == sign.len_utf8() && word.starts_with(*sign),
            _ => false,
        };
        if is_it {
            self.tokens = &self.tokens[1..];
        }
        is_it
    }

    fn expect(&mut self, sign: &str) -> Result<(), String> {
        if self.takes(sign) {
            Ok(())
        } else {
            self.fail()
        }
    }

    fn deeper(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth <= MOST_DEPTH {
            return Ok(());
        }
        let problem = format!("more than {MOST_DEPTH} brackets and dots in each other");
        Err(format!("line {}: {problem}", self.line))
    }

    fn name(&mut self) -> Result<Rc<str>, String> {
        let [Token::Name(name), rest @ ..] = self.tokens else {
            return self.fail();
        };
        self.tokens = rest;
        Ok(Rc::clone(name))
    }

    fn parameters(&mut self) -> Result<Vec<Parameter>, String> {
        let mut parameters = Vec::new();
        self.expect("(")?;
        while !self.takes(")") {
            let name = self.name()?;
            let kind = match self.takes(":") {
                true => Some(self.expr()?),
                false => None,
            };
            let default = match self.takes("=") {
                true => Some(self.expr()?),
                false => None,
            };
            parameters.push(Parameter {
                name,
                kind,
                default,
            });
            if !self.takes(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(parameters)
    }

    /// One expression, or a tuple without brackets.
    fn exprs(&mut self) -> Result<Expr, String> {
        let first = self.expr()?;
        if self.tokens.first() != Some(&Token::Sign(',')) {
            return Ok(first);
        }
        let mut list = vec![first];
        while self.takes(",") {
            if !matches!(
                self.tokens.first(),
                None | Some(Token::Sign('=' | ')' | ']'))
            ) {
                list.push(self.expr()?);
            }
        }
        Ok(Expr::List(list))
    }

    fn expr(&mut self) -> Result<Expr, String> {
        let depth = self.depth;
        self.deeper()?;
        let mut expr = self.atom()?;
        loop {
            self.deeper()?;
            if self.takes(".") {
                expr = Expr::Dot(Box::new(expr), self.name()?);
            } else if self.takes("[") {
                let place = self.exprs()?;
                self.expect("]")?;
                expr = Expr::At(Box::new(expr), Box::new(place));
            } else if self.takes("(") {
                let mut arguments = Vec::new();
                while !self.takes(")") {
                    let name = match self.tokens {
                        [Token::Name(name), Token::Sign('='), rest @ ..] => {
                            self.tokens = rest;
                            Some(Rc::clone(name))
                        }
                        _ => None,
                    };
                    arguments.push((name, self.expr()?));
                    if !self.takes(",") {
                        self.expect(")")?;
                        break;
                    }
                }
                expr = Expr::Call(Box::new(expr), arguments);
            } else {
                self.depth = depth;
                return Ok(expr);
            }
        }
    }

    fn atom(&mut self) -> Result<Expr, String> {
        let [first, rest @ ..] = self.tokens else {
            return self.fail();
        };
        let expr = match first {
            Token::Name(name) => match &**name {
                "None" => Expr::None,
                "True" => Expr::Bool(true),
                "False" => Expr::Bool(false),
                _ => Expr::Name(Rc::clone(name)),
            },
            Token::Text(text) => Expr::Text(Rc::clone(text)),
            Token::Number(text) => match (text.parse(), text.parse()) {
                (Ok(whole), _) => Expr::Int(whole),
                (_, Ok(number)) => Expr::Float(number),
                _ => return self.fail(),
            },
            Token::Sign('-') if matches!(rest.first(), Some(Token::Number(_))) => {
                self.tokens = rest;
                return match self.atom()? {
                    Expr::Int(whole) => Ok(Expr::Int(-whole)),
                    Expr::Float(number) => Ok(Expr::Float(-number)),
                    _ => self.fail(),
                };
            }
            Token::Sign('(') => {
                self.tokens = rest;
                if self.takes(")") {
                    return Ok(Expr::List(Vec::new()));
                }
                let inner = self.exprs()?;
                self.expect(")")?;
                return Ok(inner);
            }
            Token::Sign('[') => {
                self.tokens = rest;
                let mut list = Vec::new();
                while !self.takes("]") {
                    list.push(self.expr()?);
                    if !self.takes(",") {
                        self.expect("]")?;
                        break;
                    }
                }
                return Ok(Expr::List(list));
            }
            Token::Sign(_) => return self.fail(),
        };
        self.tokens = rest;
        Ok(expr)
    }
}
