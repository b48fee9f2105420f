//! The operations of torch that are taken, and what they become in ONNX. A name that ends in `_` changes its first
//! argument.

use super::graph::{Attribute, Size};
use super::walk::{Arguments, Value, Walk};
use std::rc::Rc;

type Result<T> = std::result::Result<T, String>;

impl Walk<'_> {
    /// Follows `torch.NAME(...)`. Errors are in words.
    pub fn operation(&mut self, name: &str, arguments: Arguments) -> Result<Value> {
        let plain = match name.strip_suffix('_') {
            Some(plain) if !name.starts_with("__") => plain,
            _ => name,
        };
        let target = arguments.first().map(|(_, value)| value.clone());
        let made =
            self.plain(plain, arguments)
                .map_err(|problem| match problem.starts_with("its ") {
                    true => problem,
                    false => format!("its torch.{name:.60}: {problem}"),
                })?;
        if plain == name {
            return Ok(made);
        }
        let (Some(Value::Tensor(target)), Value::Tensor(made)) = (target, made) else {
            return Err(format!("its torch.{name:.60} changes what is no tensor"));
        };
        self.graph.change(target, made)?;
        Ok(Value::Tensor(target))
    }

    fn plain(&mut self, name: &str, arguments: Arguments) -> Result<Value> {
        let made = match name {
            "linear" => {
                let [x, weight, bias] = bound(arguments, ["input", "weight", "bias"])?;
                self.linear(x, weight, bias)?
            }
            "addmm" => {
                let names = ["self", "mat1", "mat2", "beta", "alpha"];
                let [bias, a, b, beta, alpha] = bound(arguments, names)?;
                are_one([&beta, &alpha])?;
                let product = self.product(tensor(&a)?, tensor(&b)?)?;
                self.pairwise("Add", &Value::Tensor(product), &bias)?
            }
            "matmul" | "mm" => {
                let [a, b] = bound(arguments, ["self", "other"])?;
                self.product(tensor(&a)?, tensor(&b)?)?
            }
            "t" => {
                let [x] = bound(arguments, ["self"])?;
                self.transposed(tensor(&x)?)?
            }
            "relu" | "tanh" | "sigmoid" | "softplus" | "mish" | "neg" | "abs" | "sqrt" | "exp" => {
                let [x, beta, threshold] = bound(arguments, ["self", "beta", "threshold"])?;
                are_one([&beta])?;
                // Above its threshold, softplus is its argument; the difference at 20 is 2e-9.
                if number(&threshold, 20.0)? < 20.0 {
                    return Err("a threshold below 20 is not taken".into());
                }
                self.each(&initial_upper(name), &x, &[])?
            }
            "elu" | "celu" | "leaky_relu" => {
                let names = ["self", "alpha", "scale", "input_scale"];
                let [x, alpha, scale, input_scale] = bound(arguments, names)?;
                are_one([&scale, &input_scale])?;
                let (kind, usual) = match name {
                    "elu" => ("Elu", 1.0),
                    "celu" => ("Celu", 1.0),
                    _ => ("LeakyRelu", 0.01),
                };
                let alpha = number(&alpha, usual)?;
                self.each(kind, &x, &[("alpha", Attribute::Float(alpha))])?
            }
            "selu" => {
                let [x] = bound(arguments, ["self"])?;
                let alpha = ("alpha", Attribute::Float(1.673_263_242_354_377_2));
                let gamma = ("gamma", Attribute::Float(1.050_700_987_355_480_5));
                self.each("Selu", &x, &[alpha, gamma])?
            }
            "gelu" => match bound(arguments, ["self", "approximate"])? {
                [x, Value::None] => self.each("Gelu", &x, &[])?,
                [x, Value::Text(text)] if *text == *"none" => self.each("Gelu", &x, &[])?,
                _ => return Err("its approximation is not taken".into()),
            },
            "silu" => {
                let [x] = bound(arguments, ["self"])?;
                let gate = self.each("Sigmoid", &x, &[])?;
                self.pairwise("Mul", &x, &Value::Tensor(gate))?
            }
            "clamp" | "hardtanh" | "clamp_min" | "clamp_max" | "relu6" => {
                let [x, least, most] = match name {
                    "clamp_max" => {
                        let [x, most] = bound(arguments, ["self", "max"])?;
                        [x, Value::None, most]
                    }
                    _ => bound(arguments, ["self", "min", "max"])?,
                };
                let (least, most) = match name {
                    "hardtanh" => (number(&least, -1.0)?, number(&most, 1.0)?),
                    "relu6" => (0.0, 6.0),
                    _ => (number(&least, f64::MIN)?, number(&most, f64::MAX)?),
                };
                self.clamp(tensor(&x)?, least, most)?
            }
            "add" | "sub" | "mul" | "div" | "rsub" => {
                let third = if name == "div" {
                    "rounding_mode"
                } else {
                    "alpha"
                };
                let [a, b, alpha] = bound(arguments, ["self", "other", third])?;
                are_one([&alpha])?;
                let kind = match name {
                    "rsub" => return Ok(Value::Tensor(self.pairwise("Sub", &b, &a)?)),
                    other => initial_upper(other),
                };
                self.pairwise(&kind, &a, &b)?
            }
            "cat" => {
                let [list, dim] = bound(arguments, ["tensors", "dim"])?;
                self.joined(&list, whole(&dim, 0)?)?
            }
            "slice" => {
                let names = ["self", "dim", "start", "end", "step"];
                let [x, dim, start, end, step] = bound(arguments, names)?;
                are_one([&step])?;
                let range = (whole(&start, 0)?, whole(&end, i64::MAX)?);
                self.part(tensor(&x)?, whole(&dim, 0)?, range)?
            }
            "unsqueeze" => {
                let [x, dim] = bound(arguments, ["self", "dim"])?;
                let x = tensor(&x)?;
                let mut sizes = self.graph.wires[x].sizes.clone();
                let at = place(whole(&dim, 0)?, sizes.len() + 1)?;
                sizes.insert(at, Size::of(1));
                self.reshaped("Unsqueeze", x, at, sizes)?
            }
            "squeeze" => {
                let [x, dim] = bound(arguments, ["self", "dim"])?;
                let x = tensor(&x)?;
                let mut sizes = self.graph.wires[x].sizes.clone();
                let Value::Int(dim) = dim else {
                    return Err("without a dimension, it is not taken".into());
                };
                let at = place(dim.least, sizes.len())?;
                if self.graph.known(sizes.remove(at)) != Size::of(1) {
                    return Ok(Value::Tensor(x));
                }
                self.reshaped("Squeeze", x, at, sizes)?
            }
            "detach" | "contiguous" | "alias" => {
                let [x, _] = bound(arguments, ["self", "memory_format"])?;
                tensor(&x)?
            }
            "dropout" => {
                let [x, _, train] = bound(arguments, ["input", "p", "train"])?;
                match train {
                    Value::Bool(false) => tensor(&x)?,
                    _ => {
                        return Err(
                            "it drops numbers at random; call eval() before you save".into()
                        );
                    }
                }
            }
            "clone" => {
                let [x, _] = bound(arguments, ["self", "memory_format"])?;
                let x = tensor(&x)?;
                let (content, sizes) = (self.graph.content(x)?, self.graph.wires[x].sizes.clone());
                self.graph.wire(content, sizes)?
            }
            "copy" => {
                let [_, from, _] = bound(arguments, ["self", "src", "non_blocking"])?;
                tensor(&from)?
            }
            "lstm" | "gru" => return self.recurrent(name == "lstm", arguments),
            "size" => {
                let [x, dim] = bound(arguments, ["self", "dim"])?;
                let sizes = self.graph.wires[tensor(&x)?].sizes.clone();
                let sizes: Vec<Size> = sizes
                    .into_iter()
                    .map(|size| self.graph.known(size))
                    .collect();
                return Ok(match dim {
                    Value::None => Value::List(sizes.into_iter().map(Value::Int).collect()),
                    dim => Value::Int(sizes[place(whole(&dim, 0)?, sizes.len())?]),
                });
            }
            "dim" => {
                let [x] = bound(arguments, ["self"])?;
                let rank = self.graph.wires[tensor(&x)?].sizes.len();
                return Ok(Value::Int(Size::of(rank as i64)));
            }
            "eq" | "ne" => {
                let [a, b] = bound(arguments, ["self", "other"])?;
                return Ok(Value::Bool(self.equal(&a, &b)? == (name == "eq")));
            }
            "lt" | "gt" => {
                let [a, b] = bound(arguments, ["self", "other"])?;
                let (a, b) = (number(&a, f64::NAN)?, number(&b, f64::NAN)?);
                return Ok(Value::Bool(if name == "lt" { a < b } else { a > b }));
            }
            "__is__" | "__isnot__" => {
                let [a, b] = bound(arguments, ["self", "other"])?;
                let is_same = match (&a, &b) {
                    (a, Value::None) | (Value::None, a) => matches!(a, Value::None),
                    _ => return Err("it compares with something else than None".into()),
                };
                return Ok(Value::Bool(is_same == (name == "__is__")));
            }
            "__not__" => match bound(arguments, ["self"])? {
                [Value::Bool(value)] => return Ok(Value::Bool(!value)),
                _ => return Err("it is called on what is neither True nor False".into()),
            },
            "__contains__" => {
                let [list, value] = bound(arguments, ["self", "item"])?;
                let mut is_there = false;
                let list = values(&list)?;
                self.step(list.len())?;
                for one in list.iter() {
                    is_there |= self.equal(one, &value)?;
                }
                return Ok(Value::Bool(is_there));
            }
            // Kinds of numbers and places where they are: everything is float32 in the memory of the program.
            "dtype" | "device" | "layout" => return Ok(Value::None),
            "NumToTensor" => {
                let [value] = bound(arguments, ["self"])?;
                return Ok(value);
            }
            "RaiseException" => {
                let text = arguments.first().map(|(_, value)| value);
                let text = if let Some(Value::Text(text)) = text {
                    text
                } else {
                    ""
                };
                return Err(format!(
                    "its code ends with an error for a row of numbers: {text:.200}"
                ));
            }
            _ => return Err("this operation is not taken".into()),
        };
        Ok(Value::Tensor(made))
    }

    /// An operation on each number.
    fn each(&mut self, kind: &str, x: &Value, attributes: &[(&str, Attribute)]) -> Result<usize> {
        let x = tensor(x)?;
        let sizes = self.graph.wires[x].sizes.clone();
        let reads = vec![self.graph.content(x)?];
        self.made(kind, reads, attributes, sizes)
    }

    /// An operation with one output.
    fn made(
        &mut self,
        kind: &str,
        reads: Vec<String>,
        attributes: &[(&str, Attribute)],
        sizes: Vec<Size>,
    ) -> Result<usize> {
        let name = self.graph.add(kind, reads, attributes, 1)?.remove(0);
        self.graph.wire(name, sizes)
    }

    /// An operation on the numbers of two tensors one by one. One of them may be a number.
    fn pairwise(&mut self, kind: &str, a: &Value, b: &Value) -> Result<usize> {
        if !matches!((a, b), (Value::Tensor(_), _) | (_, Value::Tensor(_))) {
            return Err("it is called on what is no tensor".into());
        }
        let (mut reads, mut sizes) = (Vec::new(), Vec::new());
        for value in [a, b] {
            match value {
                Value::Tensor(x) => {
                    reads.push(self.graph.content(*x)?);
                    let own = self.graph.wires[*x].sizes.clone();
                    sizes = self.graph.broadcast(&sizes, &own)?;
                }
                _ => {
                    let number = number(value, f64::NAN)? as f32;
                    reads.push(self.graph.numbers(&[], number.to_le_bytes().into()));
                }
            }
        }
        self.made(kind, reads, &[], sizes)
    }

    fn linear(&mut self, x: Value, weight: Value, bias: Value) -> Result<usize> {
        let weight = self.transposed(tensor(&weight)?)?;
        let product = self.product(tensor(&x)?, weight)?;
        match bias {
            Value::None => Ok(product),
            bias => self.pairwise("Add", &Value::Tensor(product), &bias),
        }
    }

    fn transposed(&mut self, x: usize) -> Result<usize> {
        let mut sizes = self.graph.wires[x].sizes.clone();
        if sizes.len() != 2 {
            return Err("it transposes what is no matrix".into());
        }
        sizes.reverse();
        let reads = vec![self.graph.content(x)?];
        self.made("Transpose", reads, &[], sizes)
    }

    /// The product of rows and a matrix.
    fn product(&mut self, a: usize, b: usize) -> Result<usize> {
        let mut sizes = self.graph.wires[a].sizes.clone();
        let (Some(last), [rows, columns]) = (sizes.last_mut(), &self.graph.wires[b].sizes[..])
        else {
            return Err("it multiplies by what is no matrix".into());
        };
        let (inner, rows) = (std::mem::replace(last, *columns), *rows);
        self.graph.same(&[inner], &[rows])?;
        let reads = vec![self.graph.content(a)?, self.graph.content(b)?];
        self.made("MatMul", reads, &[], sizes)
    }

    fn clamp(&mut self, x: usize, least: f64, most: f64) -> Result<usize> {
        let mut reads = vec![self.graph.content(x)?];
        for end in [least, most] {
            let end = (end as f32).clamp(f32::MIN, f32::MAX);
            reads.push(self.graph.numbers(&[], end.to_le_bytes().into()));
        }
        let sizes = self.graph.wires[x].sizes.clone();
        self.made("Clip", reads, &[], sizes)
    }

    fn joined(&mut self, list: &Value, dim: i64) -> Result<usize> {
        let (mut reads, mut sizes): (_, Option<Vec<Size>>) = (Vec::new(), None);
        let mut at = 0;
        for value in values(list)?.iter() {
            let x = tensor(value)?;
            reads.push(self.graph.content(x)?);
            let own = self.graph.wires[x].sizes.clone();
            at = place(dim, own.len())?;
            sizes = Some(match sizes {
                None => own,
                Some(mut all) => {
                    let (sum, more) = (self.graph.known(all[at]), self.graph.known(own[at]));
                    if sum.is_observed && more.is_observed {
                        return Err("it joins parts of unknown sizes".into());
                    }
                    all[at] = own[at];
                    self.graph.same(&all, &own)?;
                    all[at] = Size {
                        least: sum.least.saturating_add(more.least),
                        is_observed: sum.is_observed || more.is_observed,
                    };
                    all
                }
            });
        }
        let sizes = sizes.ok_or("it joins nothing")?;
        self.made(
            "Concat",
            reads,
            &[("axis", Attribute::Int(at as i64))],
            sizes,
        )
    }

    fn part(&mut self, x: usize, dim: i64, (start, end): (i64, i64)) -> Result<usize> {
        let mut sizes = self.graph.wires[x].sizes.clone();
        let at = place(dim, sizes.len())?;
        if (start, end) == (0, i64::MAX) {
            return Ok(x);
        }
        sizes[at] = self.graph.range(sizes[at], start, end)?;
        let mut reads = vec![self.graph.content(x)?];
        for value in [start, end, at as i64] {
            reads.push(self.graph.whole(&[value]));
        }
        let part = self.made("Slice", reads, &[], sizes)?;
        Ok(self.view(part, x))
    }

    /// The tensor with a size of 1 added or removed.
    fn reshaped(&mut self, kind: &str, x: usize, at: usize, sizes: Vec<Size>) -> Result<usize> {
        let reads = vec![self.graph.content(x)?, self.graph.whole(&[at as i64])];
        let made = self.made(kind, reads, &[], sizes)?;
        Ok(self.view(made, x))
    }

    /// Marks a tensor that shows the numbers of another one.
    fn view(&mut self, made: usize, of: usize) -> usize {
        let seen = self.graph.wires[of].view_of;
        let seen = seen.unwrap_or((of, self.graph.wires[of].changes));
        self.graph.wires[made].view_of = Some(seen);
        made
    }

    /// A recurrent layer, or several above each other, for one row.
    fn recurrent(&mut self, is_lstm: bool, arguments: Arguments) -> Result<Value> {
        let names = [
            "input",
            "hx",
            "params",
            "has_biases",
            "num_layers",
            "dropout",
            "train",
            "bidirectional",
            "batch_first",
        ];
        let [
            x,
            memory,
            weights,
            has_biases,
            layers,
            dropout,
            train,
            two_ways,
            _,
        ] = bound(arguments, names)?;
        let memory = match is_lstm {
            true => values(&memory)?,
            false => Rc::from([memory]),
        };
        let (has_biases, layers) = (matches!(has_biases, Value::Bool(true)), whole(&layers, 1)?);
        let (weights, per_layer) = (values(&weights)?, if has_biases { 4 } else { 2 });
        let is_plain = matches!(two_ways, Value::Bool(false))
            && (matches!(train, Value::Bool(false)) || number(&dropout, 0.0)? == 0.0)
            && memory.len() == 1 + usize::from(is_lstm)
            && layers > 0
            && weights.len() as i64 == layers.saturating_mul(per_layer);
        if !is_plain {
            return Err(
                "accepted: layers in one direction, without projections and without dropout".into(),
            );
        }
        let mut x = tensor(&x)?;
        let one = Size::of(1);
        let mut starts = Vec::new();
        for (value, name) in memory.iter().zip(["h", "c"]) {
            let start = tensor(value)?;
            starts.push(start);
            self.graph.wires[start].memory = Some(name);
        }
        let mut lasts = vec![Vec::new(); memory.len()];
        for (layer, weights) in weights.chunks_exact(per_layer as usize).enumerate() {
            // The order of the gates in torch is (input, forget, cell, output) and (reset, update, new).
            let gates: &[usize] = if is_lstm { &[0, 3, 1, 2] } else { &[1, 0, 2] };
            let (mut matrices, mut hidden) = (Vec::new(), 0);
            let mut biases = Vec::new();
            for (i, weight) in weights.iter().enumerate() {
                let (sizes, raw) = self.fixed(tensor(weight)?)?;
                if i == 0 {
                    hidden = sizes.first().map_or(0, |rows| rows / gates.len());
                }
                let columns = match (i, &sizes[..]) {
                    (0, [rows, columns]) if *rows == gates.len() * hidden => *columns,
                    (1, [rows, columns]) if *rows == gates.len() * hidden && *columns == hidden => {
                        *columns
                    }
                    (2.., [rows]) if *rows == gates.len() * hidden => 1,
                    _ => return Err(format!("its weights have the sizes {sizes:?}")),
                };
                let block = 4 * hidden * columns;
                let ordered = gates
                    .iter()
                    .flat_map(|gate| &raw[gate * block..(gate + 1) * block]);
                if i < 2 {
                    let name = self
                        .graph
                        .numbers(&[1, sizes[0], columns], ordered.copied().collect());
                    matrices.push(name);
                    if i == 0 {
                        let row = [one, one, Size::of(columns as i64)];
                        let own = self.graph.wires[x].sizes.clone();
                        self.graph.same(&own, &row)?;
                    }
                } else {
                    biases.extend(ordered);
                }
            }
            let bias = match has_biases {
                true => self.graph.numbers(&[1, 2 * gates.len() * hidden], biases),
                false => String::new(),
            };
            let state = vec![one, one, Size::of(hidden as i64)];
            let mut reads = vec![self.graph.content(x)?];
            reads.append(&mut matrices);
            reads.extend([bias, String::new()]);
            for start in &starts {
                let (own, mut all) = (self.graph.wires[*start].sizes.clone(), state.clone());
                all[0] = Size::of(layers);
                self.graph.same(&own, &all)?;
                let from = layer as i64;
                let start = match layers {
                    1 => *start,
                    _ => self.part(*start, 0, (from, from + 1))?,
                };
                reads.push(self.graph.content(start)?);
            }
            let size = ("hidden_size", Attribute::Int(hidden as i64));
            let made = match is_lstm {
                true => self.graph.add("LSTM", reads, &[size], 3)?,
                false => {
                    let reset = ("linear_before_reset", Attribute::Int(1));
                    self.graph.add("GRU", reads, &[size, reset], 2)?
                }
            };
            for (lasts, name) in lasts.iter_mut().zip(&made[1..]) {
                lasts.push(Value::Tensor(self.graph.wire(name.clone(), state.clone())?));
            }
            // The output of ONNX has a size for the directions.
            let reads = vec![made[0].clone(), self.graph.whole(&[1])];
            x = self.made("Squeeze", reads, &[], state)?;
        }
        let mut all = vec![Value::Tensor(x)];
        for lasts in lasts {
            all.push(match &lasts[..] {
                [one] => one.clone(),
                _ => Value::Tensor(self.joined(&Value::List(lasts.into()), 0)?),
            });
        }
        Ok(Value::List(all.into()))
    }

    fn equal(&mut self, a: &Value, b: &Value) -> Result<bool> {
        Ok(match (a, b) {
            (Value::Int(a), Value::Int(b)) => self.graph.equal(*a, *b),
            (Value::Bool(a), Value::Bool(b)) => a == b,
            (Value::Text(a), Value::Text(b)) => a == b,
            (Value::List(a), Value::List(b)) => {
                self.step(a.len())?;
                let mut is_same = a.len() == b.len();
                for (a, b) in a.iter().zip(b.iter()) {
                    let (Value::Int(a), Value::Int(b)) = (a, b) else {
                        return Err("it compares lists of other things than sizes".into());
                    };
                    is_same = is_same && self.graph.equal(*a, *b);
                }
                is_same
            }
            _ => return Err("it compares what is not known before it runs".into()),
        })
    }
}

/// The arguments of a call in the order of their names. Those that are left out are None.
fn bound<const N: usize>(arguments: Arguments, names: [&str; N]) -> Result<[Value; N]> {
    let mut values = [const { Value::None }; N];
    for (i, (name, value)) in arguments.into_iter().enumerate() {
        let at = match &name {
            Some(name) => names.iter().position(|known| **known == **name),
            None => Some(i).filter(|i| *i < N),
        };
        let at = at.ok_or_else(|| match name {
            Some(name) => format!("the argument {name:.60?} is not taken"),
            None => format!("the argument {} is not taken", i + 1),
        })?;
        values[at] = value;
    }
    Ok(values)
}

fn tensor(value: &Value) -> Result<usize> {
    match value {
        Value::Tensor(wire) => Ok(*wire),
        _ => Err("it is called on what is no tensor".into()),
    }
}

fn values(value: &Value) -> Result<Rc<[Value]>> {
    match value {
        Value::List(list) => Ok(Rc::clone(list)),
        _ => Err("it is called on what is no list".into()),
    }
}

/// A number, or the `usual` one if it is left out.
fn number(value: &Value, usual: f64) -> Result<f64> {
    match value {
        Value::None if !usual.is_nan() => Ok(usual),
        Value::Float(number) => Ok(*number),
        Value::Int(number) if !number.is_observed => Ok(number.least as f64),
        _ => Err("it is called with something else than a number".into()),
    }
}

/// A whole number, or the `usual` one if it is left out.
fn whole(value: &Value, usual: i64) -> Result<i64> {
    match value {
        Value::None => Ok(usual),
        Value::Int(number) if !number.is_observed => Ok(number.least),
        _ => Err("it is called with something else than a whole number".into()),
    }
}

/// Fails unless all of the numbers are 1 or left out.
fn are_one<const N: usize>(values: [&Value; N]) -> Result<()> {
    for value in values {
        let number = number(value, 1.0)?;
        if number != 1.0 {
            return Err(format!("a factor or step of {number} is not taken"));
        }
    }
    Ok(())
}

/// A dimension of `count`, which counts from the end if it is negative.
fn place(dim: i64, count: usize) -> Result<usize> {
    let at = if dim < 0 {
        dim.saturating_add(count as i64)
    } else {
        dim
    };
    let at = usize::try_from(at).ok().filter(|at| *at < count);
    at.ok_or(format!("it has no dimension {dim}"))
}

fn initial_upper(name: &str) -> String {
    name[..1].to_uppercase() + &name[1..]
}
