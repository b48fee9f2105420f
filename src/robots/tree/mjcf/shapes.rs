//! The geoms of an MJCF: their shapes, and the mass that they give to a body without `<inertial>`.

use super::elements::{Element, Mjcf, origin, turn_of_z};
use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::path::Path;
use urdf_rs::Geometry;

/// The types of geoms.
pub const TYPES: [&str; 9] = [
    "sphere",
    "capsule",
    "cylinder",
    "box",
    "ellipsoid",
    "mesh",
    "plane",
    "hfield",
    "sdf",
];

/// Mass (kg), COM (m) and inertia about it (kg m^2), in the frame of a body.
#[derive(Debug, Clone, Copy)]
pub struct Inertia {
    pub mass_kg: f64,
    pub com_m: Vector3<f64>,
    pub about_com_kg_m2: Matrix3<f64>,
}

impl Inertia {
    /// A body without mass.
    pub const NONE: Inertia = Inertia {
        mass_kg: 0.0,
        com_m: Vector3::new(0.0, 0.0, 0.0),
        about_com_kg_m2: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// What has these moments about the axes of `pose`, whose origin is its COM.
    pub fn at(pose: &Isometry3<f64>, mass_kg: f64, about_com_kg_m2: Matrix3<f64>) -> Self {
        let turn = pose.rotation.to_rotation_matrix();
        Self {
            mass_kg,
            com_m: pose.translation.vector,
            about_com_kg_m2: turn * about_com_kg_m2 * turn.transpose(),
        }
    }

    /// Both as one body.
    pub fn with(&self, other: &Inertia) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return *self;
        }
        let com_m = (self.com_m * self.mass_kg + other.com_m * other.mass_kg) / mass_kg;
        let moved = |part: &Inertia| {
            let d = part.com_m - com_m;
            let square = Matrix3::identity() * d.norm_squared() - d * d.transpose();
            part.about_com_kg_m2 + square * part.mass_kg
        };
        Self {
            mass_kg,
            com_m,
            about_com_kg_m2: moved(self) + moved(other),
        }
    }

    /// A share of the mass at the same place, with coordinates that count from `from`.
    pub fn share(&self, share: f64, from: &Vector3<f64>) -> urdf_rs::Inertial {
        let i = self.about_com_kg_m2 * share;
        urdf_rs::Inertial {
            origin: origin(&Translation3::from(self.com_m - from).into()),
            mass: urdf_rs::Mass {
                value: self.mass_kg * share,
            },
            inertia: urdf_rs::Inertia {
                ixx: i[(0, 0)],
                ixy: i[(0, 1)],
                ixz: i[(0, 2)],
                iyy: i[(1, 1)],
                iyz: i[(1, 2)],
                izz: i[(2, 2)],
            },
        }
    }
}

/// A geom that is read.
pub struct Geom {
    pub pose: Isometry3<f64>,
    pub geometry: Option<Geometry>,
    pub collides: bool,
    pub rgba: Option<[f64; 4]>,
}

/// The meshes of a file, the geoms that touch each other by name, and what was left out.
pub struct Shapes<'a, 'm, 'f> {
    mjcf: &'m Mjcf<'a, 'f>,
    meshes: HashMap<&'a str, Element<'a>>,
    colors: HashMap<&'a str, [f64; 4]>,
    paired: HashSet<&'a str>,
    /// The geoms that were left out, in words.
    pub left_out: Vec<String>,
}

impl<'a, 'm, 'f> Shapes<'a, 'm, 'f> {
    pub fn of(mjcf: &'m Mjcf<'a, 'f>) -> Self {
        let (mut meshes, mut colors) = (HashMap::new(), HashMap::new());
        for element in mjcf.section("asset") {
            let file = element.node.attribute("file").unwrap_or_default();
            let stem = Path::new(file).file_stem().and_then(|stem| stem.to_str());
            let name = element.node.attribute("name").or(stem).unwrap_or_default();
            match element.node.tag_name().name() {
                "mesh" => _ = meshes.insert(name, element),
                "material" => {
                    _ = mjcf
                        .numbers(element, "rgba")
                        .map(|rgba| colors.insert(name, rgba))
                }
                _ => {}
            }
        }
        let pairs = mjcf
            .section("contact")
            .filter(|element| element.node.has_tag_name("pair"));
        let geoms = pairs.flat_map(|pair| [mjcf.text(pair, "geom1"), mjcf.text(pair, "geom2")]);
        Self {
            mjcf,
            meshes,
            colors,
            paired: geoms.flatten().collect(),
            left_out: Vec::new(),
        }
    }

    /// A geom, with its pose in the frame of the body.
    pub fn geom(&mut self, element: Element<'a>, frame: &Isometry3<f64>) -> Geom {
        let mjcf = self.mjcf;
        let bit = |name| mjcf.number(element, name) != Some(0.0);
        let is_paired = element
            .node
            .attribute("name")
            .is_some_and(|name| self.paired.contains(name));
        let (mut pose, half) = self.place(element);
        let mut geometry = self.primitive(element, half);
        let mesh = mjcf.text(element, "mesh").filter(|_| geometry.is_none());
        if let Some((moved, of_mesh)) = mesh.and_then(|mesh| self.mesh(mesh)) {
            (pose, geometry) = (pose * moved, Some(of_mesh));
        }
        if geometry.is_none() {
            self.left_out.push(mjcf.named(element.node));
        }
        let material = mjcf.text(element, "material");
        let of_material = material.and_then(|name| self.colors.get(name).copied());
        Geom {
            pose: frame * pose,
            geometry,
            collides: bit("contype") || bit("conaffinity") || is_paired,
            rgba: mjcf.numbers(element, "rgba").or(of_material),
        }
    }

    /// The pose of a geom, and its half length if two points state it (m).
    fn place(&self, element: Element<'a>) -> (Isometry3<f64>, Option<f64>) {
        let Some([a, b, c, d, e, f]) = self.mjcf.numbers(element, "fromto") else {
            return (self.mjcf.pose(element), None);
        };
        let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
        let at = Translation3::from((from + to) * 0.5);
        let pose = Isometry3::from_parts(at, turn_of_z(&(from - to)));
        (pose, Some((from - to).norm() * 0.5))
    }

    /// The sizes of a geom, with the half length `half` if two points state it (m).
    fn sizes(&self, element: Element<'a>, half: Option<f64>) -> [f64; 3] {
        let list = self.mjcf.list(element, "size", 1).unwrap_or_default();
        let at = |i: usize| list.get(i).copied().unwrap_or(0.0);
        let is_round = matches!(
            self.mjcf.text(element, "type"),
            Some("capsule" | "cylinder")
        );
        match half {
            Some(half) if is_round => [at(0), half, 0.0],
            Some(half) => [at(0), at(0), half],
            None => [at(0), at(1), at(2)],
        }
    }

    fn primitive(&self, element: Element<'a>, half: Option<f64>) -> Option<Geometry> {
        // A primitive with a mesh is fitted to it; the mesh itself is taken.
        let kind = self.mjcf.text(element, "type").unwrap_or("sphere");
        if self.mjcf.text(element, "mesh").is_some() {
            return None;
        }
        let [x, y, z] = self.sizes(element, half);
        Some(match kind {
            "sphere" => Geometry::Sphere { radius: x },
            "capsule" => Geometry::Capsule {
                radius: x,
                length: 2.0 * y,
            },
            "cylinder" => Geometry::Cylinder {
                radius: x,
                length: 2.0 * y,
            },
            "box" => Geometry::Box {
                size: urdf_rs::Vec3([2.0 * x, 2.0 * y, 2.0 * z]),
            },
            _ => return None,
        })
    }

    /// The mesh of a name, and its pose in the geom.
    fn mesh(&self, name: &str) -> Option<(Isometry3<f64>, Geometry)> {
        let mjcf = self.mjcf;
        let element = *self.meshes.get(name)?;
        let file = element.node.attribute("file")?;
        let scale = mjcf
            .vector(element, "scale")
            .unwrap_or(Vector3::repeat(1.0));
        let [w, x, y, z] = mjcf
            .numbers(element, "refquat")
            .unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = nalgebra::Quaternion::new(w, x, y, z);
        let turn = nalgebra::UnitQuaternion::try_new(turn, 1e-12).unwrap_or_default();
        let at = mjcf.vector(element, "refpos").unwrap_or_default();
        let from = Isometry3::from_parts(Translation3::from(at.component_mul(&scale)), turn);
        let is_bare = mjcf.setting("strippath") == Some("true");
        let file = match Path::new(file).file_name().and_then(|name| name.to_str()) {
            Some(name) if is_bare => name,
            _ => file,
        };
        let folder = mjcf
            .setting("meshdir")
            .or(mjcf.setting("assetdir"))
            .unwrap_or_default();
        let geometry = Geometry::Mesh {
            filename: Path::new(folder).join(file).to_string_lossy().into_owned(),
            scale: (scale != Vector3::repeat(1.0)).then(|| urdf_rs::Vec3(scale.into())),
        };
        Some((from.inverse(), geometry))
    }

    /// What a geom gives to the mass of its body. None if that is not known: for a mesh, or a shell.
    pub fn inertia(&self, element: Element<'a>, frame: &Isometry3<f64>) -> Option<Inertia> {
        let mjcf = self.mjcf;
        let group = mjcf.number(element, "group").unwrap_or(0.0);
        let groups = mjcf.setting("inertiagrouprange").unwrap_or("0 5");
        let mut groups = groups
            .split_whitespace()
            .filter_map(|n| n.parse::<f64>().ok());
        let (least, most) = (groups.next().unwrap_or(0.0), groups.next().unwrap_or(5.0));
        let mass = mjcf.number(element, "mass");
        let density = mjcf.number(element, "density").unwrap_or(1000.0);
        let kind = mjcf.text(element, "type").unwrap_or("sphere");
        if !(least..=most).contains(&group) || mass.unwrap_or(density) == 0.0 || kind == "plane" {
            return Some(Inertia::NONE);
        }
        if mjcf.text(element, "mesh").is_some()
            || mjcf.text(element, "shellinertia") == Some("true")
        {
            return None;
        }
        let (pose, half) = self.place(element);
        let [x, y, z] = self.sizes(element, half);
        let diagonal = |a: f64, b: f64, c: f64| Vector3::new(b + c, a + c, a + b);
        // The volume, and the moments of a kilogram, from the mean squares along the axes.
        let (volume, moments) = match kind {
            "sphere" => (
                4.0 / 3.0 * PI * x.powi(3),
                diagonal(x * x, x * x, x * x) / 5.0,
            ),
            "ellipsoid" => (
                4.0 / 3.0 * PI * x * y * z,
                diagonal(x * x, y * y, z * z) / 5.0,
            ),
            "box" => (8.0 * x * y * z, diagonal(x * x, y * y, z * z) / 3.0),
            "cylinder" => (
                2.0 * PI * x * x * y,
                diagonal(x * x / 4.0, x * x / 4.0, y * y / 3.0),
            ),
            "capsule" => {
                let [ball, tube] =
                    [4.0 / 3.0 * x, 2.0 * y].map(|part| part / (4.0 / 3.0 * x + 2.0 * y));
                let aside = x * x * (ball / 5.0 + tube / 4.0);
                let along = ball * (x * x / 5.0 + 0.75 * x * y + y * y) + tube * y * y / 3.0;
                (
                    PI * x * x * (4.0 / 3.0 * x + 2.0 * y),
                    diagonal(aside, aside, along),
                )
            }
            _ => return None,
        };
        let mass_kg = mass.unwrap_or(density * volume);
        let about = Matrix3::from_diagonal(&(moments * mass_kg));
        Some(Inertia::at(&(frame * pose), mass_kg, about))
    }
}
