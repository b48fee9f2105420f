//! ONNX files, as the tests write them.

/// The wire format of protobuf, as far as an ONNX file of one layer needs it.
pub mod protobuf {
    pub fn varint(mut value: u64, out: &mut Vec<u8>) {
        while value >= 0x80 {
            out.push(value as u8 | 0x80);
            value >>= 7;
        }
        out.push(value as u8);
    }

    pub fn number(field: u64, value: u64) -> Vec<u8> {
        let mut out = Vec::new();
        varint(field << 3, &mut out);
        varint(value, &mut out);
        out
    }

    pub fn bytes(field: u64, content: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        varint(field << 3 | 2, &mut out);
        varint(content.len() as u64, &mut out);
        out.extend(content);
        out
    }
}

/// A tensor of float32 in its file.
pub fn tensor(name: &str, dims: &[usize], values: &[f32]) -> Vec<u8> {
    use protobuf::{bytes, number};
    let dims = dims.iter().flat_map(|&dim| number(1, dim as u64));
    let raw: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let rest = [number(2, 1), bytes(8, name.as_bytes()), bytes(9, &raw)].concat();
    dims.chain(rest).collect()
}

/// A tensor of int64, the type of sizes.
pub fn sizes(name: &str, values: &[i64]) -> Vec<u8> {
    use protobuf::{bytes, number};
    let raw: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    [
        number(1, values.len() as u64),
        number(2, 7),
        bytes(8, name.as_bytes()),
        bytes(9, &raw),
    ]
    .concat()
}

/// An operation with the names of its inputs and outputs.
pub fn operation(kind: &str, reads: &[&str], makes: &[&str]) -> Vec<u8> {
    use protobuf::bytes;
    let names = |field: u64, names: &[&str]| {
        names
            .iter()
            .flat_map(|name| bytes(field, name.as_bytes()))
            .collect::<Vec<_>>()
    };
    [names(1, reads), names(2, makes), bytes(4, kind.as_bytes())].concat()
}

/// A network of operations and tensors, with the sizes of the rows that are its inputs and outputs.
pub fn network(
    operations: &[Vec<u8>],
    tensors: &[Vec<u8>],
    inputs: &[(&str, usize)],
    outputs: &[(&str, usize)],
) -> Vec<u8> {
    use protobuf::{bytes, number};
    let value = |field: u64, (name, size): &(&str, usize)| {
        let dim = |size: usize| bytes(1, &number(1, size as u64));
        let shape = [number(1, 1), bytes(2, &[dim(1), dim(*size)].concat())].concat();
        bytes(
            field,
            &[bytes(1, name.as_bytes()), bytes(2, &bytes(1, &shape))].concat(),
        )
    };
    let all = |field: u64, parts: &[Vec<u8>]| {
        parts
            .iter()
            .flat_map(|part| bytes(field, part))
            .collect::<Vec<_>>()
    };
    let graph = [
        all(1, operations),
        bytes(2, b"policy"),
        all(5, tensors),
        inputs.iter().flat_map(|input| value(11, input)).collect(),
        outputs
            .iter()
            .flat_map(|output| value(12, output))
            .collect(),
    ]
    .concat();
    [
        number(1, 8),
        bytes(7, &graph),
        bytes(8, &[bytes(1, b""), number(2, 13)].concat()),
    ]
    .concat()
}

/// A network `action = observation * weights + bias`; `weights` has a row for each observed number.
pub fn linear(weights: &[Vec<f32>], bias: &[f32]) -> Vec<u8> {
    let tensors = [
        tensor("weights", &[weights.len(), bias.len()], &weights.concat()),
        tensor("bias", &[bias.len()], bias),
    ];
    let gemm = operation("Gemm", &["obs", "weights", "bias"], &["action"]);
    network(
        &[gemm],
        &tensors,
        &[("obs", weights.len())],
        &[("action", bias.len())],
    )
}

/// The network with metadata.
pub fn with_metadata(network: Vec<u8>, metadata: &[(&str, &str)]) -> Vec<u8> {
    use protobuf::bytes;
    let prop = |(key, value): &(&str, &str)| {
        bytes(
            14,
            &[bytes(1, key.as_bytes()), bytes(2, value.as_bytes())].concat(),
        )
    };
    network
        .into_iter()
        .chain(metadata.iter().flat_map(prop))
        .collect()
}
