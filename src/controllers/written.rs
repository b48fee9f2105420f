//! What `standfast init` writes of a policy.

/// The file of a policy, written from what its training left.
pub struct Written {
    pub text: String,
    /// Who trained it, and where that stands.
    pub by: String,
    /// The figures that are assumed, each with the reason.
    pub assumed: Vec<String>,
}
