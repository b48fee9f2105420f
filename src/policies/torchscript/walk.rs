//! Follows `forward` from the module at the root for one row of observations.

use super::Archive;
use super::code::{self, Expr, Function, Functions, Statement};
use super::graph::{Graph, Size};
use super::pickle::{Object, Objects, StoredTensor};
use crate::limited::MOST_NUMBERS;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::rc::Rc;
use tract_onnx::pb::{GraphProto, ModelProto, OperatorSetIdProto};

/// Largest number of steps. Policies take some hundreds.
const MOST_STEPS: usize = 200_000;
/// Largest number of calls within each other.
const MOST_CALLS: usize = 40;
/// Version of the ONNX operations that are written.
const OPSET: i64 = 17;

/// What a name stands for while `forward` is followed.
#[derive(Clone)]
pub enum Value {
    None,
    Bool(bool),
    Int(Size),
    Float(f64),
    Text(Rc<str>),
    /// A list or a tuple.
    List(Rc<[Value]>),
    /// A function of the code, or a class.
    Function(Rc<str>),
    /// A module, by its place in the pickle.
    Module(usize),
    /// A tensor, by its place in the graph.
    Tensor(usize),
}

/// Arguments of a call, and their names.
pub type Arguments = Vec<(Option<Rc<str>>, Value)>;

type Names = HashMap<Rc<str>, Value>;

/// A tensor of the pickle in the graph, and its name in its module.
struct Stored {
    wire: usize,
    name: Rc<str>,
}

pub struct Walk<'a> {
    archive: Archive<'a>,
    objects: Objects,
    files: HashMap<String, Rc<Functions>>,
    pub graph: Graph,
    /// Tensors of the pickle that were read, by their places there.
    stored: BTreeMap<usize, Stored>,
    /// Values that `forward` put in the place of objects of the pickle, by their places there.
    replaced: HashMap<usize, Value>,
    steps: usize,
    calls: usize,
    /// What is left of the numbers that constants may have together.
    numbers: u64,
}

/// The network that the method `forward` of a module computes. Errors are in words.
pub fn network(archive: Archive, objects: Objects, root: usize) -> Result<ModelProto, String> {
    let mut walk = Walk {
        archive,
        objects,
        files: HashMap::new(),
        graph: Graph::default(),
        stored: BTreeMap::new(),
        replaced: HashMap::new(),
        steps: 0,
        calls: 0,
        numbers: 4 * MOST_NUMBERS,
    };
    let observed = Size {
        least: 0,
        is_observed: true,
    };
    let row = vec![Size::of(1), observed];
    let obs = walk.graph.wire("obs".into(), row.clone())?;
    let forward = walk.method(root, "forward")?;
    let parameters = forward.parameters.get(1..).unwrap_or_default();
    let needed: Vec<&str> = parameters
        .iter()
        .filter(|parameter| parameter.default.is_none())
        .map(|parameter| &*parameter.name)
        .collect();
    let is_tensor = parameters
        .first()
        .is_some_and(|parameter| match &parameter.kind {
            Some(Expr::Name(kind)) => **kind == *"Tensor",
            _ => parameter.kind.is_none(),
        });
    if needed.len() != 1 || !is_tensor {
        return Err(format!(
            "its forward takes {needed:?}; accepted: one tensor, which is the observation"
        ));
    }
    let Value::Tensor(actions) = walk.call(
        &forward,
        vec![(None, Value::Module(root)), (None, Value::Tensor(obs))],
    )?
    else {
        return Err("its forward does not return one tensor, the action".into());
    };
    walk.finished(&row, actions)
}

impl Walk<'_> {
    /// The network, once all of its operations are known.
    fn finished(mut self, row: &[Size], actions: usize) -> Result<ModelProto, String> {
        let mut proto = GraphProto {
            name: "policy".into(),
            input: vec![self.graph.end("obs", row)?],
            ..GraphProto::default()
        };
        let action = self.graph.wires[actions].sizes.clone();
        let mut ends = vec![("actions".to_string(), self.graph.content(actions)?, action)];
        let mut read: HashSet<String> = HashSet::from([ends[0].1.clone()]);
        read.extend(self.graph.nodes.iter().flat_map(|node| node.input.clone()));
        let mut entries = self.objects.list.iter().flat_map(|object| match object {
            Object::Dict(entries) => &entries[..],
            _ => &[],
        });
        let mut named = HashSet::new();
        if entries.any(|(_, of)| self.replaced.contains_key(of) && !named.insert(of)) {
            return Err("its forward replaces a tensor that has two names".into());
        }
        // Each stored tensor with the wire that is its content after this row.
        let mut stored = Vec::new();
        for (object, Stored { wire, name }) in std::mem::take(&mut self.stored) {
            let after = match self.replaced.get(&object) {
                None => wire,
                Some(Value::Tensor(after)) => *after,
                Some(_) => return Err(format!("its forward replaces the tensor {name:.100?}")),
            };
            let content = self.graph.content(after)?;
            stored.push((object, name, wire, after, content));
        }
        loop {
            let count = read.len();
            for (object, .., content) in &stored {
                if read.contains(&stored_name(*object)) {
                    read.insert(content.clone());
                }
            }
            if read.len() == count {
                break;
            }
        }
        let mut starts = Vec::new();
        for (object, name, wire, after, content) in stored {
            let before = stored_name(object);
            if !read.contains(&before) {
                continue;
            }
            let (dims, raw) = self.stored_numbers(object)?;
            if content == before {
                self.graph.named_numbers(before, &dims, raw);
                continue;
            }
            if raw.iter().any(|byte| *byte != 0) {
                let problem = "does not start at 0 in the file; reset it before you save";
                return Err(format!("its memory {name:.100?} {problem}"));
            }
            let sizes = self.graph.wires[wire].sizes.clone();
            let last = self.graph.wires[after].sizes.clone();
            self.graph.same(&sizes, &last)?;
            let memory = self.graph.wires[wire].memory.unwrap_or(&name);
            let (start, end) = (format!("{memory}_in"), format!("{memory}_out"));
            if ends.iter().any(|(name, ..)| *name == end) {
                return Err(format!("it has two memories {memory:.100?}"));
            }
            proto.input.push(self.graph.end(&start, &sizes)?);
            starts.push((start, before));
            ends.push((end, content, sizes));
        }
        for (name, content, sizes) in ends {
            proto.output.push(self.graph.end(&name, &sizes)?);
            self.graph.add("Identity", vec![content], &[], 1)?;
            self.graph.nodes.last_mut().expect("it was added").output = vec![name];
        }
        for (start, name) in starts {
            self.graph.add("Identity", vec![start], &[], 1)?;
            let mut node = self.graph.nodes.pop().expect("it was added");
            node.output = vec![name];
            self.graph.nodes.insert(0, node);
        }
        (proto.node, proto.initializer) = (self.graph.nodes, self.graph.constants);
        Ok(ModelProto {
            ir_version: 8,
            opset_import: vec![OperatorSetIdProto {
                version: OPSET,
                ..OperatorSetIdProto::default()
            }],
            graph: Some(proto),
            ..ModelProto::default()
        })
    }

    /// Counts steps.
    pub fn step(&mut self, count: usize) -> Result<(), String> {
        self.steps += 1 + count;
        match self.steps <= MOST_STEPS {
            true => Ok(()),
            false => Err("its forward has too many steps".into()),
        }
    }

    fn method(&mut self, module: usize, name: &str) -> Result<Rc<Function>, String> {
        let Object::Module { class, .. } = &self.objects.list[module] else {
            return Err(format!("{name} is called on what is no module"));
        };
        let path = format!("{class}.{name}");
        let found = self.function(&path)?;
        found.ok_or(format!("its code has no method {path:.200}"))
    }

    /// The function of a path, as `__torch__.file.NAME` or `__torch__.file.CLASS.NAME`.
    fn function(&mut self, path: &str) -> Result<Option<Rc<Function>>, String> {
        for (at, _) in path.rmatch_indices('.').take(2) {
            let file = path[..at].replace('.', "/");
            let name = format!("code/{file}.py");
            if !self.files.contains_key(&name) {
                let Some(bytes) = self.archive.text(&name)? else {
                    continue;
                };
                let functions = code::read(&String::from_utf8_lossy(&bytes));
                let functions = functions.map_err(|problem| format!("{name}: {problem}"))?;
                self.files.insert(name.clone(), Rc::new(functions));
            }
            if let Some(function) = self.files[&name].get(&path[at + 1..]) {
                return Ok(Some(Rc::clone(function)));
            }
        }
        Ok(None)
    }

    fn call(&mut self, function: &Function, arguments: Arguments) -> Result<Value, String> {
        let mut names = Names::new();
        let mut places = function.parameters.iter();
        for (name, value) in arguments {
            let name = match name {
                Some(name) => name,
                None => Rc::clone(&places.next().ok_or("a call has too many arguments")?.name),
            };
            names.insert(name, value);
        }
        for parameter in &function.parameters {
            if !names.contains_key(&parameter.name) {
                let default = parameter.default.as_ref();
                let default = default.ok_or(format!("a call lacks {:?}", parameter.name))?;
                let value = self.value(default, &Names::new())?;
                names.insert(Rc::clone(&parameter.name), value);
            }
        }
        self.calls += 1;
        if self.calls > MOST_CALLS {
            return Err(format!(
                "it has more than {MOST_CALLS} calls within each other"
            ));
        }
        let returned = self.run(&function.body, &mut names)?;
        self.calls -= 1;
        Ok(returned.unwrap_or(Value::None))
    }

    /// Follows statements up to a `return`.
    fn run(&mut self, body: &[Statement], names: &mut Names) -> Result<Option<Value>, String> {
        for statement in body {
            match statement {
                Statement::Do(expr) => _ = self.value(expr, names)?,
                Statement::Return(expr) => return self.value(expr, names).map(Some),
                Statement::Other(what) => return Err(format!("its code has, in {what}")),
                Statement::Set(target, expr) => {
                    let value = self.value(expr, names)?;
                    self.set(target, value, names)?;
                }
                Statement::If(condition, yes, no) => {
                    let Value::Bool(condition) = self.value(condition, names)? else {
                        return Err("its code branches on what is not known before it runs".into());
                    };
                    let branch = if condition { yes } else { no };
                    if let Some(value) = self.run(branch, names)? {
                        return Ok(Some(value));
                    }
                }
            }
        }
        Ok(None)
    }

    fn set(&mut self, target: &Expr, value: Value, names: &mut Names) -> Result<(), String> {
        match (target, value) {
            (Expr::Name(name), value) => _ = names.insert(Rc::clone(name), value),
            (Expr::List(targets), Value::List(values)) if targets.len() == values.len() => {
                for (target, value) in targets.iter().zip(values.iter()) {
                    self.set(target, value.clone(), names)?;
                }
            }
            (Expr::Dot(of, name), value) => {
                let Value::Module(module) = self.value(of, names)? else {
                    return Err(format!("its code sets {name:.100?} of what is no module"));
                };
                let object = self.part_of(module, name)?;
                if !matches!(self.objects.list[object], Object::Tensor(_)) {
                    let problem = "changes from row to row, and is no tensor";
                    return Err(format!("{name:.100?} of a module {problem}"));
                }
                self.replaced.insert(object, value);
            }
            _ => return Err("its code sets a target of an unknown form".into()),
        }
        Ok(())
    }

    fn value(&mut self, expr: &Expr, names: &Names) -> Result<Value, String> {
        self.step(0)?;
        Ok(match expr {
            Expr::None => Value::None,
            Expr::Bool(value) => Value::Bool(*value),
            Expr::Int(value) => Value::Int(Size::of(*value)),
            Expr::Float(value) => Value::Float(*value),
            Expr::Text(text) => Value::Text(Rc::clone(text)),
            Expr::Name(name) => {
                let value = names.get(name).cloned();
                value.ok_or(format!("its code reads {name:.100?}, which is not known"))?
            }
            Expr::List(list) => {
                let values = list.iter().map(|expr| self.value(expr, names));
                Value::List(values.collect::<Result<_, _>>()?)
            }
            Expr::At(list, place) => {
                let (list, place) = (self.value(list, names)?, self.value(place, names)?);
                match (list, place) {
                    (Value::List(list), Value::Int(place)) if !place.is_observed => {
                        let place = usize::try_from(place.least).ok();
                        let value = place.and_then(|place| list.get(place)).cloned();
                        value.ok_or("its code reads beyond the end of a list")?
                    }
                    _ => return Err("its code reads a place of what is no list".into()),
                }
            }
            Expr::Dot(of, name) => match global(expr, names) {
                Some(path) => self.global(&path)?,
                None => match self.value(of, names)? {
                    Value::Module(module) => self.attribute(module, name)?,
                    _ => return Err(format!("its code reads {name:.100?} of what is no module")),
                },
            },
            Expr::Call(function, arguments) => self.called(function, arguments, names)?,
        })
    }

    fn called(
        &mut self,
        function: &Expr,
        arguments: &[(Option<Rc<str>>, Expr)],
        names: &Names,
    ) -> Result<Value, String> {
        let path = global(function, names);
        // These two state a type before the value.
        if let (Some("annotate" | "unchecked_cast"), [_, (None, value)]) =
            (path.as_deref(), arguments)
        {
            return self.value(value, names);
        }
        if path.as_deref() == Some("uninitialized") {
            return Ok(Value::None);
        }
        let mut values = Arguments::new();
        for (name, expr) in arguments {
            values.push((name.clone(), self.value(expr, names)?));
        }
        if let Some(path) = path {
            return match path
                .strip_prefix("torch.")
                .or(path.strip_prefix("ops.prim."))
            {
                _ if path.starts_with("__torch__.") => self.of_code(&path, values),
                Some(name) if !name.contains('.') => self.operation(name, values),
                _ => match (&*path, &values[..]) {
                    ("getattr", [(_, Value::Module(module)), (_, Value::Text(name))]) => {
                        let (module, name) = (*module, Rc::clone(name));
                        self.attribute(module, &name)
                    }
                    ("int", [(_, value @ Value::Int(_))]) => Ok(value.clone()),
                    _ => Err(format!("its code calls {path:.100}, which is not taken")),
                },
            };
        }
        if let Expr::Dot(of, name) = function {
            let Value::Module(module) = self.value(of, names)? else {
                return Err(format!("{name:.100} is called on what is no module"));
            };
            let method = self.method(module, name)?;
            values.insert(0, (None, Value::Module(module)));
            return self.call(&method, values);
        }
        match self.value(function, names)? {
            Value::Function(path) => self.of_code(&path, values),
            _ => Err("its code calls what is no function".into()),
        }
    }

    fn of_code(&mut self, path: &str, arguments: Arguments) -> Result<Value, String> {
        let function = self.function(path)?;
        let function = function.ok_or(format!("its code has no function {path:.200}"))?;
        self.call(&function, arguments)
    }

    /// What a path stands for that begins with no name of the function.
    fn global(&mut self, path: &str) -> Result<Value, String> {
        if path.starts_with("__torch__.") {
            return Ok(Value::Function(path.into()));
        }
        let constant = path.strip_prefix("CONSTANTS.c");
        let place = constant.and_then(|place| place.parse::<usize>().ok());
        let found = match (place, self.objects.constants) {
            (Some(place), Some(list)) => match &self.objects.list[list] {
                Object::List(parts) => parts.get(place).copied(),
                _ => None,
            },
            _ => None,
        };
        let found = found.ok_or(format!("its code reads {path:.100}, which is not known"))?;
        self.object(found, &path.into(), 0)
    }

    fn attribute(&mut self, module: usize, name: &Rc<str>) -> Result<Value, String> {
        let object = self.part_of(module, name)?;
        match self.replaced.get(&object) {
            Some(value) => Ok(value.clone()),
            None => self.object(object, name, 0),
        }
    }

    /// The object that a module has by a name.
    fn part_of(&mut self, module: usize, name: &str) -> Result<usize, String> {
        let Object::Module {
            state: Some(state), ..
        } = self.objects.list[module]
        else {
            return Err(format!(
                "its code names {name:.100?} of a module without a state"
            ));
        };
        if let Object::Dict(entries) = &self.objects.list[state] {
            self.step(entries.len())?;
        }
        let found = self.objects.value(state, name);
        found.ok_or(format!("a module has no {name:.100?}"))
    }

    /// The value of an object of the pickle.
    fn object(&mut self, object: usize, name: &Rc<str>, depth: usize) -> Result<Value, String> {
        self.step(0)?;
        if depth > MOST_CALLS {
            return Err(format!(
                "it has more than {MOST_CALLS} lists within each other"
            ));
        }
        Ok(match &self.objects.list[object] {
            Object::None => Value::None,
            Object::Bool(value) => Value::Bool(*value),
            Object::Int(value) => Value::Int(Size::of(*value)),
            Object::Float(value) => Value::Float(*value),
            Object::Text(text) => Value::Text(Rc::clone(text)),
            Object::Module { .. } => Value::Module(object),
            Object::List(parts) => {
                let mut values = Vec::new();
                for part in parts.clone() {
                    values.push(self.object(part, name, depth + 1)?);
                }
                Value::List(values.into())
            }
            Object::Tensor(tensor) => {
                if let Some(stored) = self.stored.get(&object) {
                    return Ok(Value::Tensor(stored.wire));
                }
                let sizes = tensor.sizes.iter();
                let sizes = sizes.map(|size| Size::of(i64::try_from(*size).unwrap_or(i64::MAX)));
                let wire = self.graph.wire(stored_name(object), sizes.collect())?;
                let name = Rc::clone(name);
                self.stored.insert(object, Stored { wire, name });
                Value::Tensor(wire)
            }
            Object::Dict(_) | Object::Name(_) | Object::Storage { .. } => {
                return Err(
                    "its code reads a dictionary or another object that is not taken".into(),
                );
            }
        })
    }

    /// The sizes and numbers of a tensor of the pickle, as a constant that no operation may change.
    pub fn fixed(&mut self, wire: usize) -> Result<(Vec<usize>, Vec<u8>), String> {
        let found = self.stored.iter().find(|(_, stored)| stored.wire == wire);
        let (&object, _) = found.ok_or("the weights of a recurrent layer are computed")?;
        if self.graph.wires[wire].changes > 0 {
            return Err("it changes the weights of a recurrent layer".into());
        }
        self.graph.wires[wire].is_fixed = true;
        self.stored_numbers(object)
    }

    /// The sizes and the numbers (float32, little-endian) of a tensor of the pickle.
    fn stored_numbers(&mut self, object: usize) -> Result<(Vec<usize>, Vec<u8>), String> {
        let Object::Tensor(tensor) = &self.objects.list[object] else {
            return Err("a tensor of the pickle is none".into());
        };
        let StoredTensor {
            kind,
            file,
            offset,
            sizes,
            strides,
        } = tensor.clone();
        // A number alone may be float64: torch computes with float32 if the other tensor is of float32.
        let bytes = match &*kind {
            "FloatStorage" => 4,
            "DoubleStorage" if sizes.is_empty() => 8,
            _ => {
                return Err(format!(
                    "it computes with a tensor of numbers of the kind {kind:.40}; accepted: float32"
                ));
            }
        };
        let count = sizes
            .iter()
            .try_fold(1_u64, |product, size| product.checked_mul(*size as u64));
        let count = count.filter(|count| *count <= self.numbers);
        let count = count.ok_or(format!("its tensor of {sizes:?} numbers is too large"))?;
        self.numbers -= count;
        let stored = self.archive.numbers(&file)?;
        let mut raw = Vec::new();
        let mut place = vec![0; sizes.len()];
        for _ in 0..count {
            let at = place
                .iter()
                .zip(&strides)
                .try_fold(offset, |at, (place, stride): (&usize, &usize)| {
                    at.checked_add(place.checked_mul(*stride)?)
                });
            let from = at.and_then(|at| at.checked_mul(bytes));
            let number = from.and_then(|from| stored.get(from..from.checked_add(bytes)?));
            let number = number.ok_or(format!(
                "its tensor of {sizes:?} numbers needs more than the {} bytes of its file {file:.40}",
                stored.len()
            ))?;
            match number.try_into() {
                Ok(number) => raw.extend((f64::from_le_bytes(number) as f32).to_le_bytes()),
                Err(_) => raw.extend(number),
            }
            for (at, size) in place.iter_mut().zip(&sizes).rev() {
                *at += 1;
                if *at < *size {
                    break;
                }
                *at = 0;
            }
        }
        Ok((sizes, raw))
    }
}

/// The content of a tensor of the pickle before anything changes it.
fn stored_name(object: usize) -> String {
    format!("stored{object}")
}

/// The path of an expression like `torch.linear`, unless it begins with a name of the function.
fn global(expr: &Expr, names: &Names) -> Option<String> {
    match expr {
        Expr::Name(name) if !names.contains_key(name) => Some(name.to_string()),
        Expr::Dot(of, name) => Some(format!("{}.{name}", global(of, names)?)),
        _ => None,
    }
}
