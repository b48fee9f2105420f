//! Robots from their files.

mod landing_regions;
mod robot_files;
