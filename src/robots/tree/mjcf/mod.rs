//! Reads an MJCF, the format of MuJoCo, as the links and joints that a URDF of the same robot would have.
//!
//! The robot is the tree of bodies with a free joint; what else a scene has is left out. What an MJCF states and a URDF
//! cannot goes along: rotor inertias, friction and damping of the joints, and postures. What cannot be read and would
//! change the robot is a problem that names it; what is left out without that is noted.

mod drives;
mod elements;
mod include;
mod shapes;
#[cfg(test)]
mod tests;

use super::problems::Problems;
use super::xml::Urdf;
use crate::xml_limits;
use drives::listed;
use elements::{Body, Element, Mjcf, joint_kind, origin};
pub use include::with_included;
use nalgebra::{Isometry3, Matrix3, Translation3, Unit, Vector3};
use roxmltree::Node;
use shapes::{Inertia, Shapes};
use standfast_core::error::{Error, Result};
use standfast_core::robot::model::Frame;
use standfast_files::assets::Source;
use std::collections::HashMap;
use std::path::Path;
use urdf_rs::JointType;

/// Largest number of elements of each kind.
const MOST: [(&str, usize); 6] = [
    ("body", 500),
    ("joint", 500),
    ("geom", 5000),
    ("site", 2000),
    ("gyro", 500),
    ("key", 500),
];

/// Bound of the mass that a file may state for all of the robot (kg).
const MOST_KG: f64 = 1e9;

/// The share of a body's mass and inertia that goes to each link between two of its joints, which must have some.
const BETWEEN: f64 = 0.02;

/// Largest angle between the vertical and the z axis of the base (rad).
const UPRIGHT_RAD: f64 = 0.01;

/// Elements of a body that say nothing about the robot's mechanics.
const UNUSED: [&str; 4] = ["light", "camera", "plugin", "user"];

/// Reads an MJCF, and adds its errors to `problems`. Fails if the text is not well-formed XML, or if it is too large,
/// too deeply nested, or has no body.
pub fn read(source: &Source, problems: &mut Problems) -> Result<Urdf> {
    let document = xml_limits::of_file(&source.file, &source.text)?;
    let root = document.root_element();
    xml_limits::check_counts(&source.file, root, &MOST)?;
    let mjcf = Mjcf::of(root, include::has_own_lines(&source.text), problems);
    let mut bodies = Vec::new();
    for world in root
        .children()
        .filter(|node| node.has_tag_name("worldbody"))
    {
        let element = Element {
            node: world,
            childclass: None,
        };
        collect(&mjcf, element, None, &Isometry3::identity(), &mut bodies);
    }
    if mjcf.setting("coordinate") == Some("global") {
        let (field, problem) = ("compiler coordinate", "is not supported");
        mjcf.bad(
            root,
            field,
            "global",
            problem,
            "local, as MuJoCo has had it since 2022",
        );
    }
    for name in ["boundmass", "boundinertia", "balanceinertia"] {
        if let Some(value) = mjcf
            .setting(name)
            .filter(|value| !["0", "false"].contains(value))
        {
            mjcf.note(format!(
                "The setting {name} = {value} of <compiler> is left out."
            ));
        }
    }
    let base = base(&mjcf, &bodies).ok_or_else(|| {
        let accepted = "a tree of bodies with a free joint";
        Error::value(
            &source.file,
            "worldbody",
            "(none)",
            "there is no robot",
            accepted,
        )
    })?;
    let stem = Path::new(&source.file).file_stem().unwrap_or_default();
    let name = root
        .attribute("model")
        .map_or_else(|| stem.to_string_lossy().into(), String::from);
    let mut reader = Reader {
        mjcf: &mjcf,
        shapes: Shapes::of(&mjcf),
        torques_n_m: drives::torques_n_m(&mjcf),
        between: Vec::new(),
        sprung: Vec::new(),
        urdf: Urdf {
            robot: urdf_rs::Robot {
                name,
                version: None,
                links: Vec::new(),
                joints: Vec::new(),
                materials: Vec::new(),
            },
            link_lines: Vec::new(),
            joint_lines: Vec::new(),
            is_whole: true,
            rotor_inertias_kg_m2: Vec::new(),
            postures: drives::postures(&mjcf, &bodies),
        },
    };
    reader.robot(&bodies, base);
    let Reader {
        shapes,
        between,
        sprung,
        urdf,
        ..
    } = reader;
    for (names, what) in [
        (
            shapes.left_out,
            "Geoms are left out that are no box, sphere, capsule, cylinder or mesh of a file",
        ),
        (sprung, "Springs at joints are left out"),
        (
            between,
            "Bodies with several joints are chains of links; each link between has 2 % of the body's mass and inertia",
        ),
    ] {
        if !names.is_empty() {
            mjcf.note(format!("{what}: {}.", listed(&names)));
        }
    }
    Ok(urdf)
}

/// Collects what is within an element of the body `owner`, in the frame `frame` of that body. Bodies come in the order of
/// the file.
fn collect<'a>(
    mjcf: &Mjcf<'a, '_>,
    around: Element<'a>,
    owner: Option<usize>,
    frame: &Isometry3<f64>,
    bodies: &mut Vec<Body<'a>>,
) {
    let childclass = around.node.attribute("childclass").or(around.childclass);
    for node in around.node.children().filter(Node::is_element) {
        let element = Element { node, childclass };
        match (node.tag_name().name(), owner) {
            ("body", _) => {
                let name = node.attribute("name").map(str::to_string);
                bodies.push(Body {
                    node,
                    name: name.unwrap_or_else(|| format!("body {}", bodies.len() + 1)),
                    parent: owner,
                    pose: frame * mjcf.pose(element),
                    elements: Vec::new(),
                });
                let index = bodies.len() - 1;
                collect(mjcf, element, Some(index), &Isometry3::identity(), bodies);
            }
            ("frame", _) => collect(mjcf, element, owner, &(frame * mjcf.pose(element)), bodies),
            (tag, Some(owner)) if !UNUSED.contains(&tag) => {
                bodies[owner].elements.push((element, *frame))
            }
            (tag @ ("replicate" | "attach" | "composite" | "flexcomp"), None) => {
                mjcf.note(format!("A <{tag}> beside the robot is left out."));
            }
            _ => {}
        }
    }
}

/// The base of the robot: the outermost body with a free joint or, without one, any outermost body; of several, the one
/// that carries the most joints.
fn base<'a>(mjcf: &Mjcf<'a, '_>, bodies: &[Body<'a>]) -> Option<usize> {
    let mut joints: Vec<usize> = bodies.iter().map(|body| body.joints().count()).collect();
    for (i, body) in bodies.iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            joints[parent] += joints[i];
        }
    }
    let outermost = (0..bodies.len()).filter(|&i| bodies[i].parent.is_none());
    let is_free = |i: usize| {
        bodies[i]
            .joints()
            .any(|(joint, _)| joint_kind(mjcf, joint) == "free")
    };
    // Of equal ones, the first is taken.
    let base = outermost.rev().max_by_key(|&i| (is_free(i), joints[i]))?;
    let up = bodies[base].pose.rotation * Vector3::z();
    if up.angle(&Vector3::z()) > UPRIGHT_RAD {
        let accepted =
            "a base whose z axis points up, as another body within it may carry the turned frame";
        mjcf.bad(
            bodies[base].node,
            format!("body {}", bodies[base].name),
            format!("z points along {:.2} {:.2} {:.2}", up.x, up.y, up.z),
            "the base is turned out of the vertical",
            accepted,
        );
    }
    if !is_free(base) {
        mjcf.note(format!(
            "The base {} has no free joint in the file; it is free here.",
            bodies[base].name
        ));
    }
    let others: Vec<String> = (0..bodies.len())
        .filter(|&i| i != base && bodies[i].parent.is_none() && joints[i] > 0)
        .map(|i| bodies[i].name.clone())
        .collect();
    if !others.is_empty() {
        mjcf.note(format!(
            "Bodies beside the robot are left out, with what they carry: {}.",
            listed(&others)
        ));
    }
    Some(base)
}

struct Reader<'a, 'm, 'f> {
    mjcf: &'m Mjcf<'a, 'f>,
    shapes: Shapes<'a, 'm, 'f>,
    torques_n_m: HashMap<&'a str, f64>,
    /// Bodies with several joints, and joints with springs.
    between: Vec<String>,
    sprung: Vec<String>,
    urdf: Urdf,
}

impl<'a> Reader<'a, '_, '_> {
    fn robot(&mut self, bodies: &[Body<'a>], base: usize) {
        let mut is_of_robot = vec![false; bodies.len()];
        let mut carried: HashMap<&'a str, usize> = HashMap::new();
        for (i, body) in bodies.iter().enumerate() {
            is_of_robot[i] = i == base || body.parent.is_some_and(|parent| is_of_robot[parent]);
            let mut up = Some(i).filter(|&i| is_of_robot[i]);
            while let Some(at) = up {
                for (joint, _) in bodies[at].joints() {
                    *carried
                        .entry(joint.node.attribute("name").unwrap_or_default())
                        .or_default() += 1;
                }
                up = bodies[at].parent;
            }
        }
        let of_robot = || bodies.iter().enumerate().filter(|(i, _)| is_of_robot[*i]);
        let is_body = |name: &str| of_robot().any(|(_, body)| body.name == name);
        let coupled = drives::coupled(self.mjcf, &carried, is_body, &mut self.torques_n_m);
        // The origin of each body's link in the frame of the body (m).
        let mut origins_m = vec![Vector3::zeros(); bodies.len()];
        for (i, body) in of_robot() {
            let from = (i != base).then(|| {
                let parent = body.parent.unwrap_or(base);
                let in_link = Translation3::from(-origins_m[parent]) * body.pose;
                (bodies[parent].name.as_str(), in_link)
            });
            origins_m[i] = self.body(body, from, &coupled);
        }
        let taken: Vec<String> = of_robot().map(|(_, body)| body.name.clone()).collect();
        for (i, body) in of_robot() {
            self.sensors(body, &origins_m[i], &taken);
        }
        self.scale();
    }

    /// Adds a body, which hangs on another link, with its pose there (m). Returns the origin of its link in its frame, which
    /// is where its last joint is (m).
    fn body(
        &mut self,
        body: &Body<'a>,
        from: Option<(&str, Isometry3<f64>)>,
        coupled: &HashMap<&'a str, drives::Coupled<'a>>,
    ) -> Vector3<f64> {
        let mjcf = self.mjcf;
        for (element, _) in &body.elements {
            mjcf.check_class(*element);
            let tag = element.node.tag_name().name();
            if !["joint", "freejoint", "geom", "site", "inertial"].contains(&tag) {
                let (field, value) = (format!("body {}", body.name), mjcf.named(element.node));
                let accepted = "bodies, frames, joints, geoms, sites and inertials, written out";
                mjcf.bad(
                    element.node,
                    field,
                    value,
                    "is not supported within a robot",
                    accepted,
                );
            }
        }
        let inertia = self.inertia(body);
        let mut at = Vector3::zeros();
        let mut holder = from.map(|(parent, pose)| (parent.to_string(), pose));
        let joints: Vec<_> = body.joints().enumerate().collect();
        let moving: Vec<_> = joints
            .into_iter()
            .filter(|(_, (joint, _))| joint_kind(mjcf, *joint) != "free")
            .collect();
        let mut left = 1.0;
        for (n, (k, (element, frame))) in moving.iter().enumerate() {
            let name = body.joint_name(*k);
            let Some((parent, pose)) = holder.take() else {
                let (problem, accepted) = ("ties the base to the world", "a free joint there");
                mjcf.bad(
                    element.node,
                    format!("joint {name}"),
                    &body.name,
                    problem,
                    accepted,
                );
                break;
            };
            let anchor =
                frame * nalgebra::Point3::from(mjcf.vector(*element, "pos").unwrap_or_default());
            let pose = pose * Translation3::from(anchor.coords - at);
            at = anchor.coords;
            let is_last = n + 1 == moving.len();
            let child = match is_last {
                true => body.name.clone(),
                false => format!(
                    "{} between {name} and {}",
                    body.name,
                    body.joint_name(moving[n + 1].0)
                ),
            };
            self.joint(*element, frame, &name, [&parent, &child], pose, coupled);
            if !is_last {
                self.link(body.node, &child, inertia.share(BETWEEN, &at));
                left -= BETWEEN;
                holder = Some((child, Isometry3::identity()));
            }
        }
        if moving.len() > 1 {
            self.between.push(body.name.clone());
        }
        if let Some((parent, pose)) = holder {
            let name = format!("{} on {parent}", body.name);
            self.fixed(body.node, &name, [&parent, &body.name], &pose);
        }
        self.link(body.node, &body.name, inertia.share(left, &at));
        let back = Isometry3::from(Translation3::from(-at));
        for (element, frame) in body.of("geom") {
            let kind = mjcf.text(*element, "type").unwrap_or("sphere");
            if mjcf.text(*element, "mesh").is_none() && !shapes::TYPES.contains(&kind) {
                let field = format!("{}: type", mjcf.named(element.node));
                mjcf.bad(
                    element.node,
                    field,
                    kind,
                    "is no type of a geom",
                    &shapes::TYPES.join(", "),
                );
                continue;
            }
            let geom = self.shapes.geom(*element, frame);
            let (Some(geometry), origin) = (geom.geometry, origin(&(back * geom.pose))) else {
                continue;
            };
            let Some(link) = self.urdf.robot.links.last_mut() else {
                continue;
            };
            if geom.collides {
                link.collision.push(urdf_rs::Collision {
                    name: None,
                    origin,
                    geometry,
                });
            } else {
                let color = geom.rgba.map(|rgba| urdf_rs::Color {
                    rgba: urdf_rs::Vec4(rgba),
                });
                let material = color.map(|color| urdf_rs::Material {
                    color: Some(color),
                    ..urdf_rs::Material::default()
                });
                link.visual.push(urdf_rs::Visual {
                    name: None,
                    origin,
                    geometry,
                    material,
                });
            }
        }
        at
    }

    /// The mass of a body, in its frame: as it is stated, or of its geoms.
    fn inertia(&self, body: &Body<'a>) -> Inertia {
        let mjcf = self.mjcf;
        let from_geoms = mjcf.setting("inertiafromgeom").unwrap_or("auto");
        if let Some(&(element, frame)) = body.of("inertial").next().filter(|_| from_geoms != "true")
        {
            let mass = mjcf.number(element, "mass");
            let full = mjcf.numbers::<6>(element, "fullinertia");
            let diagonal = mjcf.vector(element, "diaginertia");
            let about = full
                .map(|[xx, yy, zz, xy, xz, yz]| Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz))
                .or(diagonal.map(|moments| Matrix3::from_diagonal(&moments)));
            if mass.is_none() {
                let field = format!("body {}: inertial mass", body.name);
                mjcf.bad(element.node, field, "(none)", "is missing", "a number [kg]");
            }
            let pose = frame * mjcf.pose(element);
            return Inertia::at(&pose, mass.unwrap_or(1.0), about.unwrap_or_default());
        }
        let mut whole = Inertia::NONE;
        for (element, frame) in body.of("geom").filter(|_| from_geoms != "false") {
            match self.shapes.inertia(*element, frame) {
                Some(part) => whole = whole.with(&part),
                None => {
                    let (field, value) = (
                        format!("body {}: mass", body.name),
                        mjcf.named(element.node),
                    );
                    let problem = "is a mesh or shell, whose mass is not found";
                    let accepted =
                        "<inertial> with mass and diaginertia, or mass=\"0\" for this geom";
                    mjcf.bad(element.node, field, value, problem, accepted);
                    return whole;
                }
            }
        }
        whole
    }

    fn link(&mut self, node: Node, name: &str, inertial: urdf_rs::Inertial) {
        self.urdf.link_lines.push(self.mjcf.line(node));
        self.urdf.robot.links.push(urdf_rs::Link {
            name: name.into(),
            inertial,
            visual: Vec::new(),
            collision: Vec::new(),
        });
    }

    fn fixed(&mut self, node: Node, name: &str, [parent, child]: [&str; 2], pose: &Isometry3<f64>) {
        self.add_joint(
            node,
            0.0,
            urdf_rs::Joint {
                name: name.into(),
                joint_type: JointType::Fixed,
                origin: origin(pose),
                parent: urdf_rs::LinkName {
                    link: parent.into(),
                },
                child: urdf_rs::LinkName { link: child.into() },
                axis: urdf_rs::Axis::default(),
                limit: urdf_rs::JointLimit::default(),
                calibration: None,
                dynamics: None,
                mimic: None,
                safety_controller: None,
            },
        );
    }

    fn add_joint(&mut self, node: Node, rotor_inertia_kg_m2: f64, joint: urdf_rs::Joint) {
        self.urdf.joint_lines.push(self.mjcf.line(node));
        self.urdf.rotor_inertias_kg_m2.push(rotor_inertia_kg_m2);
        self.urdf.robot.joints.push(joint);
    }

    /// Adds a joint between two links, with its frame in the parent.
    fn joint(
        &mut self,
        element: Element<'a>,
        frame: &Isometry3<f64>,
        name: &str,
        ends: [&str; 2],
        pose: Isometry3<f64>,
        coupled: &HashMap<&'a str, drives::Coupled<'a>>,
    ) {
        let mjcf = self.mjcf;
        let is_hinge = match joint_kind(mjcf, element) {
            "hinge" => true,
            "slide" => false,
            other => {
                let (problem, accepted) =
                    ("this type of joint is not supported", "hinge, slide, free");
                mjcf.bad(
                    element.node,
                    format!("joint {name}: type"),
                    other,
                    problem,
                    accepted,
                );
                return self.fixed(element.node, name, ends, &pose);
            }
        };
        let axis = frame.rotation * mjcf.vector(element, "axis").unwrap_or(Vector3::z());
        let angle = |angle: f64| if is_hinge { mjcf.radians(angle) } else { angle };
        let range = mjcf
            .range(element, "limited", "range")
            .map(|range| range.map(angle));
        // The pose that the file states is that at the angle `ref`.
        let at_ref = angle(mjcf.number(element, "ref").unwrap_or(0.0));
        let back = Unit::try_new(axis, 1e-9).map(|axis| match is_hinge {
            true => Isometry3::rotation(axis.into_inner() * -at_ref),
            false => Isometry3::from(Translation3::from(axis.into_inner() * -at_ref)),
        });
        if mjcf
            .number(element, "stiffness")
            .is_some_and(|stiffness| stiffness != 0.0)
        {
            self.sprung.push(name.into());
        }
        let of_joint = mjcf.range(element, "actuatorfrclimited", "actuatorfrcrange");
        let of_joint = of_joint.map(|[least, most]| least.abs().max(most.abs()));
        let torques = self
            .torques_n_m
            .get(name)
            .copied()
            .into_iter()
            .chain(of_joint);
        let [lower, upper] = range.unwrap_or_default();
        let figure = |name| mjcf.number(element, name).unwrap_or(0.0);
        let mimic = coupled.get(name).map(|coupled| urdf_rs::Mimic {
            joint: coupled.follows.into(),
            multiplier: None,
            offset: Some(coupled.offset_rad),
        });
        self.add_joint(
            element.node,
            figure("armature"),
            urdf_rs::Joint {
                name: name.into(),
                joint_type: match (is_hinge, range) {
                    (true, Some(_)) => JointType::Revolute,
                    (true, None) => JointType::Continuous,
                    (false, _) => JointType::Prismatic,
                },
                origin: origin(&(pose * back.unwrap_or_default())),
                parent: urdf_rs::LinkName {
                    link: ends[0].into(),
                },
                child: urdf_rs::LinkName {
                    link: ends[1].into(),
                },
                axis: urdf_rs::Axis {
                    xyz: urdf_rs::Vec3(axis.into()),
                },
                limit: urdf_rs::JointLimit {
                    lower,
                    upper,
                    effort: torques.reduce(f64::min).unwrap_or(0.0),
                    ..urdf_rs::JointLimit::default()
                },
                calibration: None,
                dynamics: Some(urdf_rs::Dynamics {
                    damping: figure("damping"),
                    friction: figure("frictionloss"),
                }),
                mimic,
                safety_controller: None,
            },
        );
    }

    /// Adds a link for each site that carries an IMU: by its name, or as the site of a gyroscope.
    fn sensors(&mut self, body: &Body<'a>, at: &Vector3<f64>, taken: &[String]) {
        let mjcf = self.mjcf;
        for &(site, frame) in body.of("site") {
            let Some(name) = site.node.attribute("name") else {
                continue;
            };
            let is_named = Frame::names_imu(name);
            let is_of_gyro = |sensor: Element| {
                sensor.node.has_tag_name("gyro") && sensor.node.attribute("site") == Some(name)
            };
            if !is_named && !mjcf.section("sensor").any(is_of_gyro) {
                continue;
            }
            let mut link = if is_named {
                name.to_string()
            } else {
                format!("{name} (IMU)")
            };
            if taken.contains(&link) {
                link += " (site)";
            }
            let pose = Translation3::from(-at) * frame * mjcf.pose(site);
            self.fixed(
                site.node,
                &format!("{link} on {}", body.name),
                [&body.name, &link],
                &pose,
            );
            self.link(site.node, &link, urdf_rs::Inertial::default());
        }
    }

    /// Scales all masses to the total that the file states, if it does.
    fn scale(&mut self) {
        let Some(written) = self.mjcf.setting("settotalmass") else {
            return;
        };
        let stated = written.parse().ok().filter(|mass: &f64| *mass < MOST_KG);
        if stated.is_none() {
            let root = self.mjcf.root;
            let (field, problem) = ("compiler settotalmass", "is no mass");
            self.mjcf
                .bad(root, field, written, problem, "a number of kg below 1e9");
        }
        let links = &mut self.urdf.robot.links;
        let total: f64 = links.iter().map(|link| link.inertial.mass.value).sum();
        let Some(stated) = stated.filter(|&stated| stated > 0.0 && total > 0.0) else {
            return;
        };
        for urdf_rs::Inertial {
            mass, inertia: i, ..
        } in links.iter_mut().map(|link| &mut link.inertial)
        {
            let all = [
                &mut mass.value,
                &mut i.ixx,
                &mut i.ixy,
                &mut i.ixz,
                &mut i.iyy,
                &mut i.iyz,
                &mut i.izz,
            ];
            for figure in all {
                *figure *= stated / total;
            }
        }
    }
}
