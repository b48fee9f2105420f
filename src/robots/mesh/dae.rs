//! Reads a mesh from COLLADA: the geometries of its scene, each moved by its nodes, in metres.
//!
//! The file's up axis is ignored, as in RViz, in which the authors of URDFs look at their meshes.
//!
//! The crate mesh-loader 0.1 does not replace this file: it draws a geometry once where its scene places it twice, loses
//! `<instance_node>`, the unit of translations and the sides of mirrored faces, and panics on an index out of range.

use super::Triangles;
use crate::xml_limits;
use nalgebra::{Matrix4, Point3, Rotation3, Translation3, Unit, Vector3};
use roxmltree::{Document, Node};
use std::collections::HashMap;

/// The deepest nesting of nodes, and the largest number of nodes. A node can name itself, so without a limit there
/// would be no end.
const MOST_LEVELS: usize = 32;
const MOST_NODES: usize = 10_000;
/// The largest number of triangles. A small file can name the same triangles again and again.
const MOST_TRIANGLES: usize = 4_000_000;

/// Reads the text of a file.
pub fn read(text: &str) -> Result<Triangles, String> {
    let document =
        xml_limits::document(text).map_err(|problem| format!("the XML is malformed: {problem}"))?;
    let unit_m = document
        .descendants()
        .find(|node| node.has_tag_name("unit"))
        .and_then(|unit| unit.attribute("meter"));
    let unit_m: f64 = unit_m
        .map_or(Some(1.0), |text| text.trim().parse().ok())
        .ok_or("its <unit> is no number")?;
    let mut scene = Scene {
        ids: ids(&document),
        mesh: Triangles::default(),
        nodes: 0,
    };
    let roots: Vec<Node> = match document
        .descendants()
        .find(|node| node.has_tag_name("visual_scene"))
    {
        Some(scene) => scene
            .children()
            .filter(|node| node.has_tag_name("node"))
            .collect(),
        None => Vec::new(),
    };
    for root in &roots {
        scene.add_node(root, Matrix4::identity(), 0)?;
    }
    // The geometries of a library without a scene are taken as they are.
    if roots.is_empty() {
        for geometry in document
            .descendants()
            .filter(|node| node.has_tag_name("geometry"))
        {
            scene.add_geometry(&geometry, &Matrix4::identity())?;
        }
    }
    let mut mesh = scene.mesh;
    for point in &mut mesh.points {
        *point *= unit_m;
    }
    Ok(mesh)
}

/// The elements with an `id`, by their `id`.
fn ids<'a, 'd>(document: &'a Document<'d>) -> HashMap<&'a str, Node<'a, 'd>> {
    document
        .descendants()
        .filter_map(|node| Some((node.attribute("id")?, node)))
        .collect()
}

struct Scene<'a, 'd> {
    ids: HashMap<&'a str, Node<'a, 'd>>,
    mesh: Triangles,
    /// Number of nodes so far.
    nodes: usize,
}

impl<'a, 'd> Scene<'a, 'd> {
    /// The element to which a reference such as `#id` leads.
    fn named(&self, node: &Node<'a, 'd>, attribute: &str) -> Result<Node<'a, 'd>, String> {
        let url = node.attribute(attribute).unwrap_or_default();
        self.ids
            .get(url.trim_start_matches('#'))
            .copied()
            .ok_or_else(|| format!("{url:?} does not exist"))
    }

    /// Adds the content of a node. `to_parent` is the transform from the frame of its parent to the frame of the mesh.
    fn add_node(
        &mut self,
        node: &Node<'a, 'd>,
        to_parent: Matrix4<f64>,
        level: usize,
    ) -> Result<(), String> {
        self.nodes += 1;
        if level > MOST_LEVELS || self.nodes > MOST_NODES {
            return Err(format!(
                "it has more than {MOST_NODES} nodes, or nodes nested more than {MOST_LEVELS} deep"
            ));
        }
        let mut pose = to_parent;
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "matrix" => pose *= Matrix4::from_row_slice(&some::<16>(&child)?),
                "translate" => {
                    pose *= Translation3::from(Vector3::from(some::<3>(&child)?)).to_homogeneous()
                }
                "scale" => {
                    pose *= Matrix4::new_nonuniform_scaling(&Vector3::from(some::<3>(&child)?))
                }
                "rotate" => {
                    let [x, y, z, deg] = some::<4>(&child)?;
                    if let Some(axis) = Unit::try_new(Vector3::new(x, y, z), 1e-9) {
                        pose *=
                            Rotation3::from_axis_angle(&axis, deg.to_radians()).to_homogeneous();
                    }
                }
                "node" => self.add_node(&child, pose, level + 1)?,
                "instance_node" => self.add_node(&self.named(&child, "url")?, pose, level + 1)?,
                "instance_geometry" => self.add_geometry(&self.named(&child, "url")?, &pose)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds the polygons of a geometry.
    fn add_geometry(&mut self, geometry: &Node<'a, 'd>, pose: &Matrix4<f64>) -> Result<(), String> {
        let Some(mesh) = child(geometry, "mesh") else {
            return Ok(());
        };
        // A geometry may have several lists of polygons with the same corners.
        let mut first_corners: HashMap<&str, u32> = HashMap::new();
        let is_mirrored = pose.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for polygons in mesh.children() {
            let tag = polygons.tag_name().name();
            if !["triangles", "polylist", "polygons"].contains(&tag) {
                continue;
            }
            let inputs = || {
                polygons
                    .children()
                    .filter(|node| node.has_tag_name("input"))
            };
            let offset = |input: &Node| {
                input
                    .attribute("offset")
                    .and_then(|text| text.parse().ok())
                    .unwrap_or(0_usize)
            };
            let Some(corners) =
                inputs().find(|input| input.attribute("semantic") == Some("VERTEX"))
            else {
                continue;
            };
            let (at, stride) = (
                offset(&corners),
                1 + inputs().map(|input| offset(&input)).max().unwrap_or(0),
            );
            let name = corners.attribute("source").unwrap_or_default();
            let first = match first_corners.get(name) {
                Some(first) => *first,
                None => {
                    let first = self.mesh.points.len() as u32;
                    let points = self.positions(&self.named(&corners, "source")?)?;
                    self.mesh
                        .points
                        .extend(points.iter().map(|point| pose.transform_point(point)));
                    first_corners.insert(name, first);
                    first
                }
            };
            let counts: Option<Vec<usize>> = child(&polygons, "vcount")
                .map(|node| numbers(&node))
                .transpose()?;
            let mut counts = counts.into_iter().flatten();
            for list in polygons.children().filter(|node| node.has_tag_name("p")) {
                let indices: Vec<u32> = numbers(&list)?;
                let corners: Vec<u32> = indices
                    .chunks_exact(stride)
                    .map(|corner| corner[at].saturating_add(first))
                    .collect();
                let mut rest = corners.as_slice();
                while !rest.is_empty() {
                    let count = match tag {
                        "triangles" => 3,
                        "polygons" => rest.len(),
                        _ => counts
                            .next()
                            .ok_or("a <polylist> has more corners than <vcount> says")?,
                    };
                    let (polygon, others) = rest
                        .split_at_checked(count)
                        .ok_or_else(|| format!("a <{tag}> ends within a polygon"))?;
                    rest = others;
                    match is_mirrored {
                        true => self
                            .mesh
                            .fan(&polygon.iter().rev().copied().collect::<Vec<_>>()),
                        false => self.mesh.fan(polygon),
                    }
                }
                if self.mesh.triangles.len() > MOST_TRIANGLES {
                    return Err(format!("it has more than {MOST_TRIANGLES} triangles"));
                }
            }
        }
        Ok(())
    }

    /// The points of `<vertices>`, or of a `<source>`.
    fn positions(&self, node: &Node<'a, 'd>) -> Result<Vec<Point3<f64>>, String> {
        let source = match node
            .children()
            .find(|input| input.attribute("semantic") == Some("POSITION"))
        {
            Some(input) => self.named(&input, "source")?,
            None => *node,
        };
        let accessor = source
            .descendants()
            .find(|node| node.has_tag_name("accessor"));
        let stride = accessor
            .and_then(|accessor| accessor.attribute("stride"))
            .and_then(|text| text.parse().ok());
        let array =
            child(&source, "float_array").ok_or("a source of points has no <float_array>")?;
        let numbers: Vec<f64> = numbers(&array)?;
        let rows = numbers.chunks_exact(stride.unwrap_or(3).max(3));
        Ok(rows
            .map(|row| Point3::new(row[0], row[1], row[2]))
            .collect())
    }
}

fn child<'a, 'd>(node: &Node<'a, 'd>, tag: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|child| child.has_tag_name(tag))
}

/// All numbers in a node.
fn numbers<T: std::str::FromStr>(node: &Node) -> Result<Vec<T>, String> {
    let numbers: Result<Vec<T>, _> = node
        .text()
        .unwrap_or_default()
        .split_whitespace()
        .map(str::parse)
        .collect();
    numbers.map_err(|_| {
        format!(
            "a <{}> has a word that is no such number",
            node.tag_name().name()
        )
    })
}

/// Exactly N numbers in a node.
fn some<const N: usize>(node: &Node) -> Result<[f64; N], String> {
    numbers(node)?
        .try_into()
        .map_err(|_| format!("a <{}> does not have {N} numbers", node.tag_name().name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square from (0, 0) to (1, 1) in units of 0.01 m, as a polygon of four corners with normals.
    const SQUARE: &str = r##"<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="square"><mesh>
<source id="places"><float_array id="numbers" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array>
<technique_common><accessor source="#numbers" count="4" stride="3"/></technique_common></source>
<vertices id="corners"><input semantic="POSITION" source="#places"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#corners" offset="0"/>
<input semantic="NORMAL" source="#normals" offset="1"/><vcount>4</vcount><p>0 9 1 9 2 9 3 9</p></polylist>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene">NODES</visual_scene></library_visual_scenes></COLLADA>"##;

    fn square(nodes: &str) -> Result<Triangles, String> {
        read(&SQUARE.replace("NODES", nodes))
    }

    #[test]
    fn a_scene_is_read_in_metres_with_its_nodes_nested_as_they_are() {
        let mesh = square(
            r##"<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate>
                <node><matrix>2 0 0 0  0 1 0 0  0 0 1 5  0 0 0 1</matrix><instance_geometry url="#square"/></node></node>
                <node><scale>1 -1 1</scale><instance_geometry url="#square"/></node>"##,
        )
        .unwrap();
        // (1, 1, 0) -> (2, 1, 5) -> (-1, 2, 5) -> (9, 2, 5).
        assert!(
            (mesh.points[2] - Point3::new(0.09, 0.02, 0.05)).norm() < 1e-12,
            "{}",
            mesh.points[2]
        );
        assert!(
            (mesh.points[6] - Point3::new(0.01, -0.01, 0.0)).norm() < 1e-12,
            "{}",
            mesh.points[6]
        );
        assert_eq!(
            (mesh.triangles.len(), square("").unwrap().triangles.len()),
            (4, 2),
            "without a scene, all is read"
        );
        // A mirrored polygon still faces the same side.
        for &[a, b, c] in &mesh.triangles {
            let at = |i: u32| mesh.points[i as usize];
            assert!((at(b) - at(a)).cross(&(at(c) - at(a))).z > 0.0);
        }
    }

    #[test]
    fn bad_files_are_refused_in_words() {
        let node = r##"<node id="a"><instance_geometry url="#square"/></node>"##;
        for (from, to, expected) in [
            ("#square", "#circle", "\"#circle\" does not exist"),
            (
                "<instance_geometry url=\"#square\"/>",
                "<instance_node url=\"#a\"/>",
                "nested more than 32 deep",
            ),
            ("<vcount>4", "<vcount>5", "ends within a polygon"),
            ("<vcount>4", "<vcount>", "more corners than <vcount> says"),
            (
                "0 9 1 9",
                "0 9 x 9",
                "a <p> has a word that is no such number",
            ),
            ("meter=\"0.01\"", "meter=\"cm\"", "its <unit> is no number"),
            (
                "1 1 0",
                "1 one 0",
                "a <float_array> has a word that is no such number",
            ),
        ] {
            let text = SQUARE.replace("NODES", node);
            assert!(text.contains(from), "{from}");
            let problem = read(&text.replace(from, to)).unwrap_err();
            assert!(problem.contains(expected), "{expected}: {problem}");
        }
    }
}
