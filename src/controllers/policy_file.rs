//! The file of a policy that `standfast init` writes.

/// The file of a policy, written from the records of its training.
pub struct PolicyFile {
    pub text: String,
    /// The trainer of the policy, and the file that says so.
    pub by: String,
    /// The figures that are assumed, each with the reason.
    pub assumed: Vec<String>,
}
