//! Pictures of the robot, drawn without display, graphics card or driver: stills, strips and animated pictures of an
//! episode.
//!
//! It is a small renderer of triangles with a depth buffer. No crate that draws in software knows depth, and the links
//! of a robot reach into one another. The same snapshot gives the same bytes with any number of threads. On another
//! machine the bytes may differ if its sines differ in the last digit.

#![forbid(unsafe_code)]

mod camera;
mod canvas;
mod draw;
mod files;
mod film;
mod floor;
mod frames;
mod label;
mod marks;
mod motion;
mod raster;
pub mod scene;
#[cfg(test)]
mod tests;
mod triangle;

pub use camera::Camera;
pub use draw::{draw, draw_posture};
pub use files::{png, strip};
pub use film::{FramesOptions, thumbnail};
pub use frames::{check_folder, write_frames};
pub use label::label;
