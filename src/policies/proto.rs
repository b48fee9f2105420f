//! The content of an ONNX file, checked before the library `tract` reads it. The library trusts a file: it panics or
//! fills the memory if the file states impossible sizes.

use super::limited::{MOST_NODES, MOST_NUMBERS};
use super::torchscript;
use standfast_files::assets::what_else;
use std::collections::HashSet;
use tract_onnx::pb::tensor_proto::{DataLocation, DataType};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, TensorProto, ValueInfoProto,
};
use tract_onnx::pb::{tensor_shape_proto::dimension, type_proto};
use tract_onnx::prelude::*;

/// Largest number of bytes of all tensors that are kept in other files.
const MOST_JOINED_BYTES: u64 = 16 * MOST_NUMBERS;

/// Reads a file of ONNX or TorchScript. Errors are in words.
pub fn read(bytes: &[u8]) -> Result<ModelProto, String> {
    if torchscript::is_archive(bytes) {
        return torchscript::network(bytes);
    }
    if let Some(what) = what_else(bytes) {
        return Err(format!("cannot be read: it is no ONNX file, but {what}"));
    }
    let proto = tract_onnx::onnx().proto_model_for_read(&mut &*bytes);
    proto.map_err(|e| format!("cannot be read: it is no ONNX file, or not all of one: {e:#}"))
}

/// The graph of a file, after checks: each tensor has the number of values that it states, and each operation is known
/// and reads only tensors that are made before it. Sizes that the file states beyond those of tensors and inputs are
/// removed. Errors are in words.
pub fn check(model: &mut ModelProto) -> Result<&GraphProto, String> {
    let graph = model
        .graph
        .as_mut()
        .ok_or("cannot be read: it has no graph")?;
    let known = tract_onnx::onnx().op_register.0;
    if graph.node.len() > MOST_NODES {
        return Err(format!(
            "has {} operations, more than {MOST_NODES}",
            graph.node.len()
        ));
    }
    if let Some(sparse) = graph.sparse_initializer.first() {
        let name = sparse.values.as_ref().map_or("", |tensor| &tensor.name);
        return Err(format!("its tensor {name:?} is sparse, which is not taken"));
    }
    for tensor in &graph.initializer {
        check_tensor(tensor, &format!("tensor {:?}", tensor.name))?;
    }
    for node in &graph.node {
        let its = shown(node);
        if !known.contains_key(&node.op_type) {
            return Err(format!("its {its} is none that this program can run"));
        }
        for attribute in &node.attribute {
            check_attribute(attribute, &its)?;
        }
    }
    check_wires(graph)?;
    graph.value_info.clear();
    for input in &mut graph.input {
        leave_sizes_open(input);
    }
    Ok(graph)
}

/// The tensors of a file: those that it stores, and those of its operations.
fn tensors(model: &mut ModelProto) -> impl Iterator<Item = &mut TensorProto> {
    let graph = model.graph.as_mut();
    graph.into_iter().flat_map(|graph| {
        let of_nodes = graph
            .node
            .iter_mut()
            .flat_map(|node| &mut node.attribute)
            .flat_map(|attribute| attribute.t.iter_mut().chain(&mut attribute.tensors));
        graph.initializer.iter_mut().chain(of_nodes)
    })
}

/// A number or text of where a tensor is kept outside of its file.
fn kept<'a>(tensor: &'a TensorProto, key: &str) -> Option<&'a str> {
    let entry = tensor.external_data.iter().find(|entry| entry.key == key);
    entry.map(|entry| entry.value.as_str())
}

fn is_outside(tensor: &TensorProto) -> bool {
    tensor.data_location == Some(DataLocation::External as i32)
}

/// The names of the files with tensors of this one, each once.
pub fn weight_files(model: &mut ModelProto) -> Vec<String> {
    let mut files: Vec<String> = Vec::new();
    for tensor in tensors(model).filter(|tensor| is_outside(tensor)) {
        let file = kept(tensor, "location").unwrap_or_default();
        if !files.iter().any(|known| known == file) {
            files.push(file.into());
        }
    }
    files
}

/// Puts the tensors that are kept in other files, by their names, into the file. Errors are in words.
pub fn join(model: &mut ModelProto, files: &[(String, Vec<u8>)]) -> Result<(), String> {
    let mut joined = 0;
    for tensor in tensors(model).filter(|tensor| is_outside(tensor)) {
        let file = kept(tensor, "location").unwrap_or_default();
        let Some((_, bytes)) = files.iter().find(|(name, _)| name == file) else {
            return Err(format!("its tensor {:?} is kept in {file:?}", tensor.name));
        };
        let number = |key: &str, otherwise: usize| match kept(tensor, key) {
            Some(text) => text.parse().ok(),
            None => Some(otherwise),
        };
        let range = number("offset", 0).and_then(|from| {
            let count = number("length", bytes.len().checked_sub(from)?)?;
            bytes.get(from..from.checked_add(count)?)
        });
        let Some(range) = range else {
            let place = [kept(tensor, "offset"), kept(tensor, "length")];
            return Err(format!(
                "its tensor {:?} is kept in {file:?} at {place:?} (offset, length), but that file has {} bytes",
                tensor.name,
                bytes.len()
            ));
        };
        joined += range.len() as u64;
        if joined > MOST_JOINED_BYTES {
            return Err(format!(
                "up to its tensor {:?}, it keeps more than {MOST_JOINED_BYTES} bytes in other files",
                tensor.name
            ));
        }
        tensor.raw_data = range.to_vec();
        tensor.data_location = None;
        tensor.external_data.clear();
    }
    Ok(())
}

fn shown(node: &NodeProto) -> String {
    let name = [&node.name]
        .into_iter()
        .chain(&node.output)
        .find(|name| !name.is_empty());
    format!(
        "operation {:?} ({:?})",
        name.map_or("", String::as_str),
        node.op_type
    )
}

/// The inputs of a graph that are not stored tensors.
pub fn inputs(graph: &GraphProto) -> Vec<&ValueInfoProto> {
    let stored: HashSet<&str> = graph
        .initializer
        .iter()
        .map(|tensor| tensor.name.as_str())
        .collect();
    graph
        .input
        .iter()
        .filter(|input| !stored.contains(input.name.as_str()))
        .collect()
}

/// Checks that each operation reads only tensors that are made before it, and that no tensor is made twice.
fn check_wires(graph: &GraphProto) -> Result<(), String> {
    let stored = graph.initializer.iter().map(|tensor| &tensor.name);
    let mut made: HashSet<&str> = stored
        .chain(graph.input.iter().map(|input| &input.name))
        .map(String::as_str)
        .collect();
    for node in &graph.node {
        if let Some(lost) = node
            .input
            .iter()
            .find(|name| !name.is_empty() && !made.contains(name.as_str()))
        {
            return Err(format!(
                "its {} reads {lost:?}, which nothing before it makes",
                shown(node)
            ));
        }
        for name in node.output.iter().filter(|name| !name.is_empty()) {
            if !made.insert(name) {
                return Err(format!(
                    "its {} makes {name:?}, which is there already",
                    shown(node)
                ));
            }
        }
    }
    for output in &graph.output {
        if !made.contains(output.name.as_str()) {
            return Err(format!(
                "its output {:?} is made by no operation",
                output.name
            ));
        }
    }
    Ok(())
}

/// Checks an attribute of an operation.
fn check_attribute(attribute: &AttributeProto, of: &str) -> Result<(), String> {
    if attribute.g.is_some() || !attribute.graphs.is_empty() {
        return Err(format!(
            "its {of} has networks within it, which are not taken: conditions and loops"
        ));
    }
    for number in &attribute.ints {
        check_whole(*number, of)?;
    }
    for tensor in attribute.t.iter().chain(&attribute.tensors) {
        check_tensor(
            tensor,
            &format!("{of} has a tensor {:?}, which", attribute.name),
        )?;
    }
    Ok(())
}

/// Checks a whole number, which may be a size: the library would misread a size above the limit. The largest and the
/// smallest integer are accepted, since they stand for the ends of a range.
pub fn check_whole(number: i64, its: &str) -> Result<(), String> {
    const MOST: u64 = i32::MAX as u64;
    if number.unsigned_abs() <= MOST || number.unsigned_abs() >= i64::MAX as u64 {
        return Ok(());
    }
    Err(format!(
        "its {its} has the number {number}; up to {MOST} are taken"
    ))
}

/// Checks that a tensor has the number of values that it states.
fn check_tensor(tensor: &TensorProto, its: &str) -> Result<(), String> {
    let kind = DataType::try_from(tensor.data_type).unwrap_or(DataType::Undefined);
    let (bytes, numbers) = match kind {
        DataType::Float => (4, tensor.float_data.len()),
        DataType::Double => (8, tensor.double_data.len()),
        DataType::Int64 | DataType::Uint64 => (8, tensor.int64_data.len()),
        DataType::Int32 | DataType::Uint32 => (4, tensor.int32_data.len()),
        DataType::Float16 | DataType::Int16 | DataType::Uint16 => (2, tensor.int32_data.len()),
        DataType::Bool | DataType::Int8 | DataType::Uint8 => (1, tensor.int32_data.len()),
        DataType::String if tensor.raw_data.is_empty() => (1, tensor.string_data.len()),
        _ => {
            return Err(format!(
                "its {its} has numbers of a kind that is not taken: {}",
                kind.as_str_name()
            ));
        }
    };
    let dims = &tensor.dims;
    let stated = dims.iter().try_fold(1_u64, |product, &dim| {
        product.checked_mul(u64::try_from(dim).ok()?)
    });
    let Some(stated) = stated.filter(|stated| *stated <= MOST_NUMBERS) else {
        return Err(format!(
            "its {its} has the sizes {dims:?}; up to {MOST_NUMBERS} numbers are taken"
        ));
    };
    let stored = if tensor.raw_data.is_empty() {
        bytes * numbers
    } else {
        tensor.raw_data.len()
    };
    if stated * bytes as u64 == stored as u64 {
        return Ok(());
    }
    Err(format!(
        "its {its} has the sizes {dims:?}, but {stored} bytes of numbers instead of {}",
        stated * bytes as u64
    ))
}

/// Removes named sizes of an input: they stand for the batch size.
fn leave_sizes_open(input: &mut ValueInfoProto) {
    let Some(type_proto::Value::TensorType(tensor)) =
        input.r#type.as_mut().and_then(|kind| kind.value.as_mut())
    else {
        return;
    };
    for dim in tensor.shape.iter_mut().flat_map(|shape| &mut shape.dim) {
        if matches!(dim.value, Some(dimension::Value::DimParam(_))) {
            dim.value = None;
        }
    }
}
