//! TorchScript files, as `torch.jit.save` writes them, become the same content that an ONNX file has. Such a file is a
//! ZIP archive: `data.pkl` is the tree of modules with their numbers, and `code/` has the methods of the modules as text.
//! The method `forward` is followed for one row of observations, and each operation of torch that it comes to becomes one
//! of ONNX. Whatever is not known here is refused, and nothing of the file is ever executed.

mod code;
mod graph;
mod operations;
mod pickle;
#[cfg(test)]
mod tests;
mod walk;

use super::limited::MOST_NUMBERS;
use std::collections::HashMap;
use std::io::{Cursor, Read};
use std::rc::Rc;
use tract_onnx::pb::ModelProto;
use zip::ZipArchive;

/// Largest number of bytes of code and pickles together. Policies have some 30,000.
const MOST_TEXT_BYTES: u64 = 1 << 20;
/// Largest number of bytes of all numbers together, unpacked.
const MOST_BYTES: u64 = 16 * MOST_NUMBERS;
/// Largest number of files in the archive. Policies have some 50.
const MOST_FILES: usize = 10_000;

/// Whether a file is a ZIP archive, and so perhaps one of TorchScript.
pub fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK")
}

/// The network in a file: its input is `obs` [1, numbers observed], its output is `actions`. Each memory that `forward`
/// keeps in its module becomes an input and an output: `h_in` and `h_out`, `c_in` and `c_out` [layers, 1, size] of an
/// LSTM or a GRU; of anything else, the name in the module with `_in` and `_out`. Errors are in words.
pub fn network(bytes: &[u8]) -> Result<ModelProto, String> {
    let mut archive =
        Archive::open(bytes).map_err(|problem| format!("cannot be read: {problem}"))?;
    let objects = archive.objects();
    let (objects, root) = objects.map_err(|problem| format!("cannot be read: {problem}"))?;
    walk::network(archive, objects, root).map_err(|problem| {
        format!(
            "its TorchScript cannot be taken over: {problem}; `torch.onnx.export(torch.jit.load(\"FILE.pt\"), \
             torch.zeros(1, N), \"FILE.onnx\")` in Python writes an ONNX file of a network that observes N numbers"
        )
    })
}

/// The archive, with what is left of the limits.
struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// The folder in which everything is.
    root: String,
    text_bytes: u64,
    bytes: u64,
    /// Numbers that were unpacked, by their file.
    numbers: HashMap<Rc<str>, Rc<[u8]>>,
}

impl<'a> Archive<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let zip = ZipArchive::new(Cursor::new(bytes))
            .map_err(|e| format!("it is no ZIP archive, or not all of one: {e}"))?;
        if zip.len() > MOST_FILES {
            return Err(format!(
                "its archive has {} files, more than {MOST_FILES}",
                zip.len()
            ));
        }
        let root = zip.file_names().find_map(|name| {
            let root = name.strip_suffix("/data.pkl")?;
            (!root.contains('/')).then(|| root.to_string())
        });
        let Some(root) = root else {
            return Err("it is a ZIP archive without data.pkl, and so no TorchScript".into());
        };
        let code = format!("{root}/code/");
        if !zip.file_names().any(|name| name.starts_with(&code)) {
            return Err(
                "it is a checkpoint, which has numbers and no code of a network; accepted: ONNX, which \
                 `torch.onnx.export` writes, or TorchScript, which `torch.jit.save` writes"
                    .into(),
            );
        }
        let mut archive = Self {
            zip,
            root,
            text_bytes: MOST_TEXT_BYTES,
            bytes: MOST_BYTES,
            numbers: HashMap::new(),
        };
        let order = archive.text("byteorder")?;
        match order.as_deref() {
            None | Some(b"little") => Ok(archive),
            Some(_) => Err("its numbers are not in the order of little-endian machines".into()),
        }
    }

    /// The objects of both pickles, and the module at the root.
    fn objects(&mut self) -> Result<(pickle::Objects, usize), String> {
        let mut objects = pickle::Objects::default();
        let mut read = |name: &str, folder: &str| {
            let bytes = self.text(name)?.ok_or(format!("it has no {name}"))?;
            let root = objects.read(&bytes, folder);
            root.map_err(|problem| format!("its {name} {problem}"))
        };
        let root = read("data.pkl", "data")?;
        objects.constants = Some(read("constants.pkl", "constants")?);
        Ok((objects, root))
    }

    /// A file of code or a pickle. It is None if there is no such file.
    fn text(&mut self, name: &str) -> Result<Option<Vec<u8>>, String> {
        let bytes = unpacked(&mut self.zip, &self.root, name, self.text_bytes)?;
        self.text_bytes -= bytes.as_ref().map_or(0, Vec::len) as u64;
        Ok(bytes)
    }

    /// A file of numbers.
    fn numbers(&mut self, name: &Rc<str>) -> Result<Rc<[u8]>, String> {
        if let Some(numbers) = self.numbers.get(name) {
            return Ok(Rc::clone(numbers));
        }
        let bytes = unpacked(&mut self.zip, &self.root, name, self.bytes)?;
        let bytes = bytes.ok_or(format!("it has no file {name:?} of numbers"))?;
        self.bytes -= bytes.len() as u64;
        let numbers: Rc<[u8]> = bytes.into();
        self.numbers.insert(Rc::clone(name), Rc::clone(&numbers));
        Ok(numbers)
    }
}

/// A file of up to `most` bytes. It is None if there is no such file.
fn unpacked(
    zip: &mut ZipArchive<Cursor<&[u8]>>,
    root: &str,
    name: &str,
    most: u64,
) -> Result<Option<Vec<u8>>, String> {
    let path = format!("{root}/{name}");
    if zip.index_for_name(&path).is_none() {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    let entry = zip.by_name(&path).map_err(|e| format!("its {name}: {e}"))?;
    let read = entry.take(most + 1).read_to_end(&mut bytes);
    read.map_err(|e| format!("its {name}: {e}"))?;
    if bytes.len() as u64 > most {
        return Err(format!(
            "up to its {name}, it unpacks to more than {MOST_TEXT_BYTES} bytes of code or {MOST_BYTES} of numbers"
        ));
    }
    Ok(Some(bytes))
}
