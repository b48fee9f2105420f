//! Collisions and visuals of links, with their meshes.

use super::problems::Problems;
use super::xml::{Urdf, isometry};
use crate::mesh::bundle::{self, Named};
use crate::mesh::{files, search, simplify};
use nalgebra::Vector3;
use standfast_core::robot::mesh::Mesh;
use standfast_core::robot::model::Solid;
use standfast_core::robot::shape::Shape;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Largest number of drawn triangles of all meshes together, which keeps the page of a replay below one megabyte.
const MOST_TRIANGLES: usize = 10_000;
/// Largest number of names that a note lists.
const MOST_NAMED: usize = 6;
/// Radius of the ball that replaces a collision of size 0 (m).
const POINT_M: f64 = 0.001;
const GREY: [f64; 4] = [0.7, 0.7, 0.7, 1.0];

/// The solids of all URDF links, each in the frame of its link.
pub struct Solids {
    pub collisions: Vec<Vec<Solid>>,
    pub visuals: Vec<Vec<Solid>>,
    /// The collision meshes that were not read: index of the URDF link, and name of the mesh with the reason.
    pub missing: Vec<(usize, String)>,
    /// The meshes as a text (see [`bundle`]); None if the URDF names none.
    pub kept_meshes: Option<String>,
}

fn named(geometry: &urdf_rs::Geometry) -> Option<(Named, Vector3<f64>)> {
    let urdf_rs::Geometry::Mesh { filename, scale } = geometry else {
        return None;
    };
    let scale = scale.map_or(Vector3::repeat(1.0), |scale| Vector3::from(*scale));
    Some((
        (
            filename.clone(),
            [scale.x, scale.y, scale.z].map(f64::to_bits),
        ),
        scale,
    ))
}

impl Solids {
    pub fn read(urdf: &Urdf, file: &str, problems: &mut Problems) -> Self {
        let (meshes, kept_meshes, reasons) = meshes(urdf, file, problems);
        let colors = Colors::of(&urdf.robot);
        let mut solids = Self {
            collisions: Vec::new(),
            visuals: Vec::new(),
            missing: Vec::new(),
            kept_meshes,
        };
        let mut points = 0;
        for (index, (link, &line)) in urdf.robot.links.iter().zip(&urdf.link_lines).enumerate() {
            let mut solid = |what: &str,
                             origin: &urdf_rs::Pose,
                             geometry: &urdf_rs::Geometry,
                             color: [f64; 4]| {
                if let urdf_rs::Geometry::Sphere { radius: 0.0 } = geometry {
                    points += 1;
                    let shape = Shape::Sphere { radius: POINT_M };
                    return (what == "collision").then(|| Solid {
                        frame: index,
                        pose: isometry(origin),
                        shape,
                        color,
                    });
                }
                let shape = match named(geometry) {
                    Some((named, _)) => Shape::Mesh(meshes.get(&named)?.clone()),
                    None => primitive(geometry)?,
                };
                check_sizes(
                    &format!("link {}: {what}", link.name),
                    line,
                    geometry,
                    problems,
                );
                Some(Solid {
                    frame: index,
                    pose: isometry(origin),
                    shape,
                    color,
                })
            };
            let collisions = link.collision.iter();
            solids.collisions.push(
                collisions
                    .filter_map(|c| solid("collision", &c.origin, &c.geometry, GREY))
                    .collect(),
            );
            let visuals = link.visual.iter();
            let visuals = visuals
                .filter_map(|v| solid("visual", &v.origin, &v.geometry, colors.of_visual(v)));
            solids.visuals.push(visuals.collect());
            for collision in &link.collision {
                let Some((named, _)) = named(&collision.geometry) else {
                    continue;
                };
                if !meshes.contains_key(&named) {
                    let (name, _) = named;
                    let reason = reasons
                        .iter()
                        .find(|(mesh, _)| *mesh == name)
                        .map_or("not among the kept meshes", |(_, why)| why);
                    solids.missing.push((index, format!("{name} ({reason})")));
                }
            }
        }
        if points > 0 {
            let sized = format!(
                "{points} spheres of radius 0 are taken for contact points, balls of {} mm.",
                1e3 * POINT_M
            );
            problems.notes.push(sized);
        }
        solids
    }
}

/// The shape of a geometry that is no mesh.
fn primitive(geometry: &urdf_rs::Geometry) -> Option<Shape> {
    Some(match *geometry {
        urdf_rs::Geometry::Box { size } => Shape::Box {
            half: Vector3::from(*size) / 2.0,
        },
        urdf_rs::Geometry::Cylinder { radius, length } => Shape::Cylinder { radius, length },
        urdf_rs::Geometry::Capsule { radius, length } => Shape::Capsule { radius, length },
        urdf_rs::Geometry::Sphere { radius } => Shape::Sphere { radius },
        urdf_rs::Geometry::Mesh { .. } => return None,
    })
}

fn check_sizes(field: &str, line: usize, geometry: &urdf_rs::Geometry, problems: &mut Problems) {
    let (kind, sizes) = match geometry {
        urdf_rs::Geometry::Box { size } => ("box", size.to_vec()),
        urdf_rs::Geometry::Cylinder { radius, length } => ("cylinder", vec![*radius, *length]),
        urdf_rs::Geometry::Capsule { radius, length } => ("capsule", vec![*radius, *length]),
        urdf_rs::Geometry::Sphere { radius } => ("sphere", vec![*radius]),
        urdf_rs::Geometry::Mesh { .. } => return,
    };
    if sizes.iter().any(|size| *size <= 0.0) {
        problems.add(
            line,
            format!("{field}: {kind}"),
            format!("{sizes:?}"),
            "must be positive",
            "numbers > 0",
        );
    }
}

/// Names of meshes that cannot be read, each with the reason.
type Reasons = Vec<(String, String)>;

/// The meshes that a URDF names, and their text. They come from the text that is kept beside the URDF or, without it,
/// from the readable mesh files, thinned together. Meshes that cannot be read are noted, and returned with the reason.
fn meshes(
    urdf: &Urdf,
    file: &str,
    problems: &mut Problems,
) -> (HashMap<Named, Arc<Mesh>>, Option<String>, Reasons) {
    // Each mesh in the order of the file, with the number of times that it is drawn.
    let mut names: Vec<(Named, Vector3<f64>, usize)> = Vec::new();
    let mut places: HashMap<Named, usize> = HashMap::new();
    for link in &urdf.robot.links {
        let of_visuals = link.visual.iter().map(|v| (&v.geometry, true));
        let are_drawn = link.visual.is_empty();
        for (geometry, is_drawn) in
            of_visuals.chain(link.collision.iter().map(|c| (&c.geometry, are_drawn)))
        {
            let Some((named, scale)) = named(geometry) else {
                continue;
            };
            let place = *places.entry(named.clone()).or_insert_with(|| {
                names.push((named, scale, 0));
                names.len() - 1
            });
            names[place].2 += usize::from(is_drawn);
        }
    }
    if names.is_empty() {
        return (HashMap::new(), None, Vec::new());
    }
    let (urdf_path, roots) = (Path::new(file), search::package_roots());
    if let Some(text) = bundle::beside(urdf_path) {
        match text.and_then(|text| Ok((bundle::read(&text)?, text))) {
            Ok((meshes, text)) => {
                let meshes: HashMap<Named, Arc<Mesh>> = meshes.into_iter().collect();
                let lost = names
                    .iter()
                    .filter(|(named, ..)| !meshes.contains_key(named));
                let lost: Vec<&str> = lost.map(|((name, _), ..)| name.as_str()).collect();
                if !lost.is_empty() {
                    problems.notes.push(format!(
                        "{} left out: not among the meshes that are kept.",
                        listed(&lost)
                    ));
                }
                return (meshes, Some(text), Vec::new());
            }
            Err(problem) => problems.add(
                0,
                "mesh",
                "the meshes beside it",
                problem,
                "the file as a result keeps it",
            ),
        }
    }
    let (mut absent, mut pointers): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    let mut reasons = Reasons::new();
    let (mut keys, mut hulls, mut drawn) = (Vec::new(), Vec::new(), Vec::new());
    for (named, scale, times) in &names {
        let name = &named.0;
        let read = match search::find(name, urdf_path, &roots) {
            None => {
                absent.push(name);
                continue;
            }
            Some(path) if files::is_lfs_pointer(&path) => {
                pointers.push(name);
                continue;
            }
            Some(_) if scale.iter().any(|factor| *factor == 0.0) => {
                Err("its scale is 0".to_string())
            }
            Some(path) => files::read(&path),
        };
        match read {
            Ok(mesh) => {
                let mesh = mesh.scaled(scale);
                keys.push(named.clone());
                hulls.push(Mesh::new(mesh.points.clone(), Vec::new()).hull);
                drawn.push((mesh, *times));
            }
            Err(problem) => {
                problems
                    .notes
                    .push(format!("The mesh {name} is left out: {problem}."));
                reasons.push((name.clone(), problem));
            }
        }
    }
    for name in &absent {
        reasons.push((name.to_string(), "no such file".into()));
    }
    for name in &pointers {
        reasons.push((name.to_string(), "only a Git LFS pointer is there".into()));
    }
    if let Some(first) = absent.first() {
        problems.notes.push(format!(
            "{} left out: no such file. {}",
            listed(&absent),
            searched(first, urdf_path)
        ));
    }
    if !pointers.is_empty() {
        let list = listed(&pointers);
        problems.notes.push(format!(
            "{list} left out: only a Git LFS pointer is there; `git lfs pull` fetches the file."
        ));
    }
    simplify::thin(&mut drawn, MOST_TRIANGLES);
    let mut meshes: Vec<(Named, Arc<Mesh>)> = Vec::with_capacity(keys.len());
    for ((key, hull), (thinned, _)) in keys.into_iter().zip(hulls).zip(drawn) {
        let mesh = Mesh {
            points: thinned.points,
            triangles: thinned.triangles,
            hull,
        };
        meshes.push((key, Arc::new(mesh)));
    }
    let text = bundle::text(&meshes);
    (meshes.into_iter().collect(), Some(text), reasons)
}

/// "The mesh a.stl is", or "3 meshes (a.stl, b.stl, c.stl) are".
fn listed(names: &[&str]) -> String {
    if let [name] = names {
        return format!("The mesh {name} is");
    }
    let more = if names.len() > MOST_NAMED {
        ", ..."
    } else {
        ""
    };
    format!(
        "{} meshes ({}{more}) are",
        names.len(),
        names[..names.len().min(MOST_NAMED)].join(", ")
    )
}

/// The places where a mesh of this name was searched.
fn searched(name: &str, urdf: &Path) -> String {
    let absolute = std::path::absolute(urdf).unwrap_or_else(|_| urdf.into());
    let folder = absolute.parent().unwrap_or(Path::new("/")).display();
    if name.starts_with("package://") || name.starts_with("model://") {
        format!(
            "Packages are searched in {folder}, in the folders that hold it, and in those of ROS_PACKAGE_PATH."
        )
    } else {
        format!("File names count from {folder}.")
    }
}

/// The colours of the materials by name: the first colour that any material of the name has.
struct Colors<'a>(HashMap<&'a str, [f64; 4]>);

impl<'a> Colors<'a> {
    fn of(urdf: &'a urdf_rs::Robot) -> Self {
        let mut colors = HashMap::new();
        let in_visuals = urdf
            .links
            .iter()
            .flat_map(|link| &link.visual)
            .filter_map(|visual| visual.material.as_ref());
        for material in urdf
            .materials
            .iter()
            .chain(in_visuals)
            .filter(|material| !material.name.is_empty())
        {
            if let Some(color) = &material.color {
                colors.entry(material.name.as_str()).or_insert(*color.rgba);
            }
        }
        Self(colors)
    }

    fn of_visual(&self, visual: &urdf_rs::Visual) -> [f64; 4] {
        let Some(material) = &visual.material else {
            return GREY;
        };
        let own = material.color.as_ref().map(|color| *color.rgba);
        let color = own
            .or_else(|| self.0.get(material.name.as_str()).copied())
            .unwrap_or(GREY);
        color.map(|part| part.clamp(0.0, 1.0))
    }
}
