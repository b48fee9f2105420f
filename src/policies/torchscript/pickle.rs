//! The pickles in a TorchScript file. They are read, and never executed: a name that is not known here is refused.

use std::collections::HashMap;
use std::rc::Rc;

/// Largest number of sizes of a tensor.
pub const MOST_SIZES: usize = 8;

/// An object. Parts of it are places in [`Objects::list`], so that shared and circular ones take no room of their own.
pub enum Object {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(Rc<str>),
    List(Vec<usize>),
    /// Keys and values.
    Dict(Vec<(usize, usize)>),
    /// A name that was found among those that are known.
    Name(Rc<str>),
    Module {
        class: Rc<str>,
        state: Option<usize>,
    },
    /// The numbers of tensors: their kind, as `FloatStorage`, and their file.
    Storage {
        kind: Rc<str>,
        file: Rc<str>,
    },
    Tensor(StoredTensor),
}

/// A tensor within a storage. Offset and strides count numbers.
#[derive(Clone)]
pub struct StoredTensor {
    pub kind: Rc<str>,
    pub file: Rc<str>,
    pub offset: usize,
    pub sizes: Vec<usize>,
    pub strides: Vec<usize>,
}

/// All objects of some pickles.
#[derive(Default)]
pub struct Objects {
    pub list: Vec<Object>,
    /// The list of the constants of the code.
    pub constants: Option<usize>,
}

impl Objects {
    /// Reads a pickle whose storages are in a folder, and returns its object. Errors are in words, after "its pickle".
    pub fn read(&mut self, bytes: &[u8], folder: &str) -> Result<usize, String> {
        let mut reader = Reader {
            bytes,
            folder,
            objects: self,
            stack: Vec::new(),
            marks: Vec::new(),
            memo: HashMap::new(),
        };
        loop {
            if let Some(object) = reader.step()? {
                return Ok(object);
            }
        }
    }

    /// The value of a key of a dictionary.
    pub fn value(&self, dict: usize, key: &str) -> Option<usize> {
        let Object::Dict(entries) = &self.list[dict] else {
            return None;
        };
        let is_it = |at: usize| matches!(&self.list[at], Object::Text(text) if **text == *key);
        let entry = entries.iter().rev().find(|(at, _)| is_it(*at));
        entry.map(|(_, value)| *value)
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    folder: &'a str,
    objects: &'a mut Objects,
    stack: Vec<usize>,
    marks: Vec<usize>,
    memo: HashMap<u32, usize>,
}

impl Reader<'_> {
    /// Reads one instruction. The last one gives the object.
    fn step(&mut self) -> Result<Option<usize>, String> {
        let [code] = self.array()?;
        match code {
            0x80 => _ = self.array::<1>()?,
            b'.' => return self.pop().map(Some),
            b'N' => self.push(Object::None),
            0x88 => self.push(Object::Bool(true)),
            0x89 => self.push(Object::Bool(false)),
            b'K' => {
                let [value] = self.array()?;
                self.push(Object::Int(value.into()));
            }
            b'M' => {
                let value = u16::from_le_bytes(self.array()?);
                self.push(Object::Int(value.into()));
            }
            b'J' => {
                let value = i32::from_le_bytes(self.array()?);
                self.push(Object::Int(value.into()));
            }
            0x8a => {
                let [length] = self.array()?;
                let bytes = self.take(length.into())?;
                if bytes.len() > 8 {
                    return Err(format!("has a whole number of {length} bytes"));
                }
                let negative = bytes.last().is_some_and(|byte| *byte >= 0x80);
                let mut all = [if negative { 0xff } else { 0 }; 8];
                all[..bytes.len()].copy_from_slice(bytes);
                self.push(Object::Int(i64::from_le_bytes(all)));
            }
            b'G' => {
                let value = f64::from_be_bytes(self.array()?);
                self.push(Object::Float(value));
            }
            b'X' => {
                let length = u32::from_le_bytes(self.array()?);
                let bytes = self.take(length as usize)?;
                let text = str::from_utf8(bytes).map_err(|_| "has a text that is not UTF-8")?;
                let text = Object::Text(text.into());
                self.push(text);
            }
            b'c' => {
                let name = format!("{}.{}", self.line()?, self.line()?);
                if !is_known(&name) {
                    return Err(format!(
                        "names {name:.100}, which no policy needs, and which is not run; accepted: modules of \
                         TorchScript, tensors and their numbers"
                    ));
                }
                self.push(Object::Name(name.into()));
            }
            b'q' => {
                let [key] = self.array()?;
                self.keep(key.into())?;
            }
            b'r' => {
                let key = u32::from_le_bytes(self.array()?);
                self.keep(key)?;
            }
            b'h' => {
                let [key] = self.array()?;
                self.recall(key.into())?;
            }
            b'j' => {
                let key = u32::from_le_bytes(self.array()?);
                self.recall(key)?;
            }
            b'(' => self.marks.push(self.stack.len()),
            b')' | b']' => self.push(Object::List(Vec::new())),
            b'}' => self.push(Object::Dict(Vec::new())),
            0x85..=0x87 => {
                let parts = self.last(usize::from(code - 0x84))?;
                self.push(Object::List(parts));
            }
            b't' => {
                let parts = self.marked()?;
                self.push(Object::List(parts));
            }
            b'a' | b'e' => {
                let parts = match code {
                    b'a' => self.last(1)?,
                    _ => self.marked()?,
                };
                match self.top()? {
                    Object::List(list) => list.extend(parts),
                    _ => return Err("appends to what is no list".into()),
                }
            }
            b's' | b'u' => {
                let parts = match code {
                    b's' => self.last(2)?,
                    _ => self.marked()?,
                };
                match self.top()? {
                    Object::Dict(entries) => {
                        entries.extend(parts.chunks_exact(2).map(|pair| (pair[0], pair[1])));
                    }
                    _ => return Err("puts entries into what is no dictionary".into()),
                }
            }
            b'Q' => {
                let what = self.pop()?;
                let storage = self.storage(what).ok_or("has numbers of an unknown form")?;
                self.push(storage);
            }
            b'R' | 0x81 => {
                let (arguments, name) = (self.pop()?, self.pop()?);
                let Object::Name(name) = &self.objects.list[name] else {
                    return Err("calls what is no name".into());
                };
                let name = Rc::clone(name);
                if name.starts_with("__torch__.") {
                    let (class, state) = (name, None);
                    self.push(Object::Module { class, state });
                } else if name.starts_with("torch._utils._rebuild_tensor") {
                    let tensor = self
                        .tensor(arguments)
                        .ok_or("has a tensor of an unknown form")?;
                    self.push(tensor);
                } else if &*name == "collections.OrderedDict" {
                    self.push(Object::Dict(Vec::new()));
                } else {
                    // What is left are functions that return their first argument.
                    let parts = self.parts(arguments).and_then(|parts| parts.first());
                    let first = parts.ok_or(format!("calls {name} without a value"))?;
                    self.stack.push(*first);
                }
            }
            b'b' => {
                let content = self.pop()?;
                match self.top()? {
                    Object::Module { state, .. } => *state = Some(content),
                    _ => return Err("gives a state to what is no module".into()),
                }
            }
            other => {
                return Err(format!(
                    "has the instruction {other:#04x}, which no policy needs"
                ));
            }
        }
        Ok(None)
    }

    fn take(&mut self, length: usize) -> Result<&[u8], String> {
        let (taken, rest) = self
            .bytes
            .split_at_checked(length)
            .ok_or("ends too early")?;
        self.bytes = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        Ok(self.take(N)?.try_into().expect("so many were taken"))
    }

    fn line(&mut self) -> Result<String, String> {
        let end = self.bytes.iter().position(|byte| *byte == b'\n');
        let line = self.take(end.ok_or("ends too early")? + 1)?;
        Ok(String::from_utf8_lossy(&line[..line.len() - 1]).into_owned())
    }

    fn push(&mut self, object: Object) {
        self.stack.push(self.objects.list.len());
        self.objects.list.push(object);
    }

    fn pop(&mut self) -> Result<usize, String> {
        Ok(self.last(1)?[0])
    }

    /// The last `count` objects since the last mark, taken off.
    fn last(&mut self, count: usize) -> Result<Vec<usize>, String> {
        let floor = self.marks.last().map_or(0, |mark| *mark);
        let from = self
            .stack
            .len()
            .checked_sub(count)
            .filter(|from| *from >= floor);
        Ok(self.stack.split_off(from.ok_or("takes more than was put")?))
    }

    /// The objects since the last mark, taken off with it.
    fn marked(&mut self) -> Result<Vec<usize>, String> {
        let mark = self.marks.pop().ok_or("takes more than was put")?;
        Ok(self.stack.split_off(mark))
    }

    fn top(&mut self) -> Result<&mut Object, String> {
        let top = self.stack.last().ok_or("takes more than was put")?;
        Ok(&mut self.objects.list[*top])
    }

    fn keep(&mut self, key: u32) -> Result<(), String> {
        let top = self.stack.last().ok_or("takes more than was put")?;
        self.memo.insert(key, *top);
        Ok(())
    }

    fn recall(&mut self, key: u32) -> Result<(), String> {
        let kept = self.memo.get(&key).ok_or("takes what was not kept")?;
        self.stack.push(*kept);
        Ok(())
    }

    fn parts(&self, at: usize) -> Option<&[usize]> {
        match &self.objects.list[at] {
            Object::List(parts) => Some(parts),
            _ => None,
        }
    }

    /// The storage of ('storage', kind, file, device, count).
    fn storage(&self, at: usize) -> Option<Object> {
        let [_, kind, file, ..] = self.parts(at)? else {
            return None;
        };
        match (&self.objects.list[*kind], &self.objects.list[*file]) {
            (Object::Name(kind), Object::Text(file)) => Some(Object::Storage {
                kind: kind.strip_prefix("torch.")?.into(),
                file: format!("{}/{file}", self.folder).into(),
            }),
            _ => None,
        }
    }

    /// The tensor of (storage, offset, sizes, strides, ...).
    fn tensor(&self, at: usize) -> Option<Object> {
        let [storage, offset, sizes, strides, ..] = self.parts(at)? else {
            return None;
        };
        let Object::Storage { kind, file } = &self.objects.list[*storage] else {
            return None;
        };
        let whole = |at: &usize| match self.objects.list[*at] {
            Object::Int(value) => usize::try_from(value).ok(),
            _ => None,
        };
        let list = |at: &usize| {
            self.parts(*at)?
                .iter()
                .map(whole)
                .collect::<Option<Vec<_>>>()
        };
        let (sizes, strides) = (list(sizes)?, list(strides)?);
        (sizes.len() == strides.len() && sizes.len() <= MOST_SIZES).then_some(())?;
        Some(Object::Tensor(StoredTensor {
            kind: Rc::clone(kind),
            file: Rc::clone(file),
            offset: whole(offset)?,
            sizes,
            strides,
        }))
    }
}

/// Whether a pickle of TorchScript has this name.
fn is_known(name: &str) -> bool {
    const KNOWN: [&str; 8] = [
        "collections.OrderedDict",
        "torch._utils._rebuild_tensor_v2",
        "torch._utils._rebuild_parameter",
        "torch.jit._pickle.restore_type_tag",
        "torch.jit._pickle.build_intlist",
        "torch.jit._pickle.build_doublelist",
        "torch.jit._pickle.build_boollist",
        "torch.jit._pickle.build_tensorlist",
    ];
    let is_storage = name
        .strip_prefix("torch.")
        .and_then(|name| name.strip_suffix("Storage"))
        .is_some_and(|kind| kind.chars().all(char::is_alphabetic));
    KNOWN.contains(&name) || name.starts_with("__torch__.") || is_storage
}
