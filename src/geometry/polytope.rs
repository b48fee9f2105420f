//! Convex polytopes `{x | S x <= 1}` and the linear programs on them.
