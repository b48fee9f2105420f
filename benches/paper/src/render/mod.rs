//! What the commands found, as text, JSON, pictures and the page of the paper's figures. These modules draw and write,
//! and simulate nothing.

pub mod bode;
pub mod imposed;
pub mod page;
pub mod published;
pub mod response;
