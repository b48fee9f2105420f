//! Replaces the network if the program was built without ONNX.

/// A network, of which there is no value.
pub enum Net {}

impl Net {
    /// Fails, with the reason.
    pub fn of(_bytes: &[u8], _sizes: [usize; 2]) -> Result<Self, String> {
        Err("cannot be run: this program was built without ONNX; build it by `cargo build --release --features onnx`"
            .into())
    }

    pub fn run(&self, _observation: Vec<f32>) -> Result<Vec<f32>, String> {
        match *self {}
    }
}
