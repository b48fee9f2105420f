//! The network that is built: operations of ONNX, and the sizes of what they make. How many numbers are observed is not
//! stated in a TorchScript file; it is found from the first operation that takes only one size.

use super::pickle::MOST_SIZES;
use crate::limited::{MOST_NODES, MOST_NUMBERS};
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::type_proto::{Tensor as TensorType, Value as TypeValue};
use tract_onnx::pb::{
    AttributeProto, NodeProto, TensorProto, TensorShapeProto, TypeProto, ValueInfoProto,
};

/// A size: `least`, and the count of the observed numbers on top if it depends on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    pub least: i64,
    pub is_observed: bool,
}

impl Size {
    pub fn of(least: i64) -> Self {
        let is_observed = false;
        Self { least, is_observed }
    }
}

/// A tensor of float32 while the network runs.
#[derive(Clone)]
pub struct Wire {
    /// The operation's output that is its content. It changes with each operation in place.
    pub name: String,
    pub sizes: Vec<Size>,
    /// How often it was changed in place.
    pub changes: usize,
    /// The wire whose numbers it shows a part of, and how often that had been changed.
    pub view_of: Option<(usize, usize)>,
    /// Whether its content is already used as a constant.
    pub is_fixed: bool,
    /// The name of the memory of a recurrent layer that it is: `h` or `c`.
    pub memory: Option<&'static str>,
}

pub enum Attribute {
    Int(i64),
    Float(f64),
}

#[derive(Default)]
pub struct Graph {
    pub nodes: Vec<NodeProto>,
    pub constants: Vec<TensorProto>,
    pub wires: Vec<Wire>,
    /// Number of the observed numbers, once it is known.
    observed: Option<i64>,
    /// The smallest number of them for which the sizes hold.
    at_least: i64,
    names: usize,
}

impl Graph {
    pub fn name(&mut self) -> String {
        self.names += 1;
        format!("t{}", self.names)
    }

    /// A new tensor.
    pub fn wire(&mut self, name: String, sizes: Vec<Size>) -> Result<usize, String> {
        if sizes.len() > MOST_SIZES {
            return Err(format!("it makes a tensor of more than {MOST_SIZES} sizes"));
        }
        let numbers = sizes.iter().try_fold(1_u64, |product, size| {
            product.checked_mul(u64::try_from(size.least.max(1)).ok()?)
        });
        if numbers.is_none_or(|numbers| numbers > MOST_NUMBERS) {
            let sizes = self.shown(&sizes);
            return Err(format!(
                "it makes a tensor of {sizes} numbers; up to {MOST_NUMBERS} are taken"
            ));
        }
        self.wires.push(Wire {
            name,
            sizes,
            changes: 0,
            view_of: None,
            is_fixed: false,
            memory: None,
        });
        Ok(self.wires.len() - 1)
    }

    /// The present content of a tensor.
    pub fn content(&self, wire: usize) -> Result<String, String> {
        let wire = &self.wires[wire];
        if let Some((of, changes)) = wire.view_of
            && self.wires[of].changes != changes
        {
            return Err("it reads a part of a tensor that was changed meanwhile".into());
        }
        Ok(wire.name.clone())
    }

    /// Puts the content of a tensor into another one.
    pub fn change(&mut self, wire: usize, to: usize) -> Result<(), String> {
        let name = self.content(to)?;
        let (own, other) = (self.wires[wire].sizes.clone(), self.wires[to].sizes.clone());
        self.same(&own, &other)?;
        let wire = &mut self.wires[wire];
        if wire.view_of.is_some() || wire.is_fixed {
            return Err(
                "it changes a part of a tensor, or one that is a constant elsewhere".into(),
            );
        }
        wire.name = name;
        wire.changes += 1;
        Ok(())
    }

    /// Adds an operation of ONNX with the contents that it reads, and returns what it makes.
    pub fn add(
        &mut self,
        kind: &str,
        reads: Vec<String>,
        attributes: &[(&str, Attribute)],
        count: usize,
    ) -> Result<Vec<String>, String> {
        if self.nodes.len() >= MOST_NODES {
            return Err(format!("it has more than {MOST_NODES} operations"));
        }
        let makes: Vec<String> = (0..count).map(|_| self.name()).collect();
        let attribute = |(name, value): &(&str, Attribute)| {
            let mut proto = AttributeProto {
                name: (*name).into(),
                ..AttributeProto::default()
            };
            match value {
                Attribute::Int(value) => {
                    (proto.r#type, proto.i) = (AttributeType::Int as i32, *value);
                }
                Attribute::Float(value) => {
                    (proto.r#type, proto.f) = (AttributeType::Float as i32, *value as f32);
                }
            }
            proto
        };
        self.nodes.push(NodeProto {
            name: makes[0].clone(),
            op_type: kind.into(),
            input: reads,
            output: makes.clone(),
            attribute: attributes.iter().map(attribute).collect(),
            ..NodeProto::default()
        });
        Ok(makes)
    }

    /// A constant of float32.
    pub fn numbers(&mut self, dims: &[usize], raw_data: Vec<u8>) -> String {
        let name = self.name();
        self.constant(name, DataType::Float, dims, raw_data)
    }

    /// A constant of float32 with a name.
    pub fn named_numbers(&mut self, name: String, dims: &[usize], raw_data: Vec<u8>) {
        self.constant(name, DataType::Float, dims, raw_data);
    }

    /// A constant of int64 in a row.
    pub fn whole(&mut self, values: &[i64]) -> String {
        let raw_data = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        let name = self.name();
        self.constant(name, DataType::Int64, &[values.len()], raw_data)
    }

    fn constant(
        &mut self,
        name: String,
        kind: DataType,
        dims: &[usize],
        raw_data: Vec<u8>,
    ) -> String {
        self.constants.push(TensorProto {
            name: name.clone(),
            dims: dims.iter().map(|dim| *dim as i64).collect(),
            data_type: kind as i32,
            raw_data,
            ..TensorProto::default()
        });
        name
    }

    /// The size, without the count of observed numbers if that is known.
    pub fn known(&self, size: Size) -> Size {
        match self.observed {
            Some(observed) if size.is_observed => Size::of(size.least.saturating_add(observed)),
            _ => size,
        }
    }

    /// Whether two sizes are the same. An unknown count of observed numbers becomes that with which they are.
    pub fn equal(&mut self, a: Size, b: Size) -> bool {
        let (a, b) = (self.known(a), self.known(b));
        let (open, size) = match (a.is_observed, b.is_observed) {
            (true, false) => (a, b),
            (false, true) => (b, a),
            _ => return a == b,
        };
        let observed = size.least.saturating_sub(open.least);
        let fits = observed >= self.at_least.max(1) && observed <= MOST_NUMBERS as i64;
        if fits {
            self.observed = Some(observed);
        }
        fits
    }

    /// Fails unless the sizes are the same.
    pub fn same(&mut self, a: &[Size], b: &[Size]) -> Result<(), String> {
        let are = a.len() == b.len() && a.iter().zip(b).all(|(a, b)| self.equal(*a, *b));
        if are {
            return Ok(());
        }
        let (a, b) = (self.shown(a), self.shown(b));
        Err(format!("sizes do not fit: {a} and {b}"))
    }

    /// The sizes of an operation on the numbers of two tensors one by one.
    pub fn broadcast(&mut self, a: &[Size], b: &[Size]) -> Result<Vec<Size>, String> {
        let count = a.len().max(b.len());
        let at = |graph: &Self, sizes: &[Size], i: usize| {
            let i = (i + sizes.len()).checked_sub(count);
            i.map_or(Size::of(1), |i| graph.known(sizes[i]))
        };
        let mut made = Vec::new();
        for i in 0..count {
            made.push(match (at(self, a, i), at(self, b, i)) {
                (a, b) if a == Size::of(1) => b,
                (a, b) if b == Size::of(1) => a,
                (a, b) => {
                    self.same(&[a], &[b])?;
                    a
                }
            });
        }
        Ok(made)
    }

    /// The size of the numbers from `start` to before `end`, which count from the end if they are negative.
    pub fn range(&mut self, size: Size, start: i64, end: i64) -> Result<Size, String> {
        let size = self.known(size);
        let mut place = |at: i64| -> Result<Size, String> {
            let from_end = Size {
                least: size.least.saturating_add(at),
                ..size
            };
            let place = match at {
                i64::MAX => size,
                _ if at < 0 => from_end,
                _ => Size::of(at),
            };
            let is_inside = match (place.is_observed, size.is_observed) {
                (false, true) => {
                    self.at_least = self.at_least.max(place.least.saturating_sub(size.least));
                    place.least >= 0
                }
                (true, _) => {
                    self.at_least = self.at_least.max(place.least.saturating_neg());
                    true
                }
                _ => (0..=size.least).contains(&place.least),
            };
            match is_inside {
                true => Ok(place),
                false => Err(format!(
                    "it takes the place {at} of {} numbers",
                    self.shown(&[size])
                )),
            }
        };
        let (start, end) = (place(start)?, place(end)?);
        let length = Size {
            least: end.least.saturating_sub(start.least),
            is_observed: end.is_observed != start.is_observed,
        };
        if start.is_observed && !end.is_observed || !length.is_observed && length.least < 0 {
            return Err("it takes numbers between places whose order is not known".into());
        }
        Ok(length)
    }

    /// The sizes in words.
    pub fn shown(&self, sizes: &[Size]) -> String {
        let shown = sizes.iter().map(|size| match self.known(*size) {
            Size {
                least,
                is_observed: false,
            } => least.to_string(),
            Size { least, .. } => format!("N + {least}"),
        });
        format!("[{}]", shown.collect::<Vec<_>>().join(", "))
    }

    /// An input or output of the network, whose sizes have to be known.
    pub fn end(&self, name: &str, sizes: &[Size]) -> Result<ValueInfoProto, String> {
        let mut dim = Vec::new();
        for size in sizes {
            let size = self.known(*size);
            if size.is_observed {
                return Err("nothing in it says how many numbers it observes".into());
            }
            dim.push(Dimension {
                value: Some(dimension::Value::DimValue(size.least)),
                ..Dimension::default()
            });
        }
        let tensor = TensorType {
            elem_type: DataType::Float as i32,
            shape: Some(TensorShapeProto { dim }),
        };
        Ok(ValueInfoProto {
            name: name.into(),
            r#type: Some(TypeProto {
                value: Some(TypeValue::TensorType(tensor)),
                ..TypeProto::default()
            }),
            ..ValueInfoProto::default()
        })
    }
}
