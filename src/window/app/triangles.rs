//! Triangles with a colour at each corner, collected anew for every frame and drawn at once.
//!
//! Without a GPU, kiss3d's lit material takes most of a second for a frame. Its material `normals`, which shows the
//! normal n of a vertex as the colour (n + 1) / 2, takes a tenth of this time. Therefore light is computed here for
//! each corner, and passed instead of the normals.

use kiss3d::glamx::Vec3;
use kiss3d::procedural::{IndexBuffer, RenderMesh};
use kiss3d::resource::GpuMesh3d;
use kiss3d::resource::vertex_index::VertexIndex;
use kiss3d::scene::SceneNode3d;
use nalgebra::Point3;
use std::cell::RefCell;
use std::rc::Rc;

/// Linear light: red, green and blue, from 0 to 1.
pub type Rgb = Vec3;

/// Corners (m, world frame) and their colours. Three in a row are a triangle.
#[derive(Debug, Default)]
pub struct ColoredTriangles {
    corners: Vec<Vec3>,
    colors: Vec<Vec3>,
}

impl ColoredTriangles {
    pub fn clear(&mut self) {
        self.corners.clear();
        self.colors.clear();
    }

    /// Adds a corner. Every third corner completes a triangle.
    pub fn corner(&mut self, at: Vec3, color: Rgb) {
        self.corners.push(at);
        self.colors.push(2.0 * color - Vec3::ONE);
    }

    /// Adds a convex polygon from its corners and their colours.
    pub fn polygon(&mut self, corners: &[(Point3<f64>, Rgb)]) {
        for i in 2..corners.len() {
            for (at, color) in [0, i - 1, i].map(|i| corners[i]) {
                self.corner(vec3(&at), color);
            }
        }
    }
}

pub struct OnCard {
    node: SceneNode3d,
}

impl OnCard {
    pub fn new(scene: &mut SceneNode3d) -> Self {
        // kiss3d does not accept an empty buffer, so the buffer begins with a triangle of no size.
        let nothing = RenderMesh::new(
            vec![Vec3::ZERO; 3],
            Some(vec![Vec3::ZERO; 3]),
            None,
            Some(IndexBuffer::Unified(vec![[0, 1, 2]])),
        );
        let mesh = Rc::new(RefCell::new(GpuMesh3d::from_render_mesh(nothing, true)));
        let mut node = scene.add_mesh(mesh, Vec3::ONE);
        node.set_material_with_name("normals");
        node.enable_backface_culling(false);
        Self { node }
    }

    /// Shows these triangles from the next frame on.
    pub fn show(&mut self, triangles: &ColoredTriangles) {
        let count = triangles.corners.len() as VertexIndex;
        self.node
            .modify_vertices(&mut |corners| corners.clone_from(&triangles.corners));
        self.node
            .modify_normals(&mut |normals| normals.clone_from(&triangles.colors));
        self.node.modify_faces(&mut |faces| {
            faces.clear();
            faces.extend((0..count / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]));
        });
    }
}

/// A point in single precision, for the graphics card.
pub fn vec3(p: &Point3<f64>) -> Vec3 {
    Vec3::new(p.x as f32, p.y as f32, p.z as f32)
}
