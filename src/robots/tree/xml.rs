//! Reads the XML of a URDF: checks the parts that this program uses, leaves out the rest, and gives the result to
//! urdf-rs.
//!
//! The parser of urdf-rs fails with the first element that it does not expect, such as a `<texture/>` without a file,
//! and does not tell where. So it gets a text with known elements and valid values only. Each problem is reported with
//! line, element and attribute; a harmless value replaces a bad one, so that the rest can be checked.

use super::problems::Problems;
use crate::xml_limits;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;
use standfast_core::error::{Error, Result};
use standfast_files::assets::Source;
use std::fmt::Write;

/// Largest number of elements of each kind.
const MOST: [(&str, usize); 4] = [
    ("link", 500),
    ("joint", 500),
    ("visual", 5000),
    ("collision", 5000),
];

struct Attribute {
    name: &'static str,
    /// Number of numbers in the attribute; 0 for text.
    numbers: usize,
    /// The value that replaces a missing or bad one.
    harmless: &'static str,
    is_required: bool,
}

/// An element that is read, with its attributes, and the elements that may contain it. If `repeats`, all elements of
/// this name are read, else only the first one.
struct Element {
    name: &'static str,
    within: &'static str,
    repeats: bool,
    attributes: &'static [Attribute],
}

const fn required(name: &'static str, numbers: usize, harmless: &'static str) -> Attribute {
    Attribute {
        name,
        numbers,
        harmless,
        is_required: true,
    }
}

const fn optional(name: &'static str, numbers: usize, harmless: &'static str) -> Attribute {
    Attribute {
        name,
        numbers,
        harmless,
        is_required: false,
    }
}

const fn element(
    name: &'static str,
    within: &'static str,
    attributes: &'static [Attribute],
) -> Element {
    Element {
        name,
        within,
        repeats: false,
        attributes,
    }
}

const fn repeated(
    name: &'static str,
    within: &'static str,
    attributes: &'static [Attribute],
) -> Element {
    Element {
        name,
        within,
        repeats: true,
        attributes,
    }
}

const ELEMENTS: [Element; 22] = [
    repeated("link", "robot", &[required("name", 0, "?")]),
    repeated(
        "joint",
        "robot",
        &[required("name", 0, "?"), required("type", 0, "fixed")],
    ),
    repeated("material", "robot", &[optional("name", 0, "")]),
    element("inertial", "link", &[]),
    repeated("visual", "link", &[]),
    repeated("collision", "link", &[]),
    element("mass", "inertial", &[required("value", 1, "1")]),
    element(
        "inertia",
        "inertial",
        &[
            required("ixx", 1, "1"),
            required("ixy", 1, "0"),
            required("ixz", 1, "0"),
            required("iyy", 1, "1"),
            required("iyz", 1, "0"),
            required("izz", 1, "1"),
        ],
    ),
    element(
        "origin",
        "inertial visual collision joint",
        &[optional("xyz", 3, "0 0 0"), optional("rpy", 3, "0 0 0")],
    ),
    element("geometry", "visual collision", &[]),
    element("material", "visual", &[optional("name", 0, "")]),
    element("box", "geometry", &[required("size", 3, "1 1 1")]),
    element(
        "cylinder",
        "geometry",
        &[required("radius", 1, "1"), required("length", 1, "1")],
    ),
    element(
        "capsule",
        "geometry",
        &[required("radius", 1, "1"), required("length", 1, "1")],
    ),
    element("sphere", "geometry", &[required("radius", 1, "1")]),
    element(
        "mesh",
        "geometry",
        &[required("filename", 0, "?"), optional("scale", 3, "1 1 1")],
    ),
    element("color", "material", &[optional("rgba", 4, "")]),
    element("parent", "joint", &[required("link", 0, "?")]),
    element("child", "joint", &[required("link", 0, "?")]),
    element("axis", "joint", &[required("xyz", 3, "1 0 0")]),
    element(
        "limit",
        "joint",
        &[
            optional("lower", 1, "0"),
            optional("upper", 1, "0"),
            optional("effort", 1, "0"),
            optional("velocity", 1, "0"),
        ],
    ),
    element(
        "mimic",
        "joint",
        &[
            required("joint", 0, "?"),
            optional("multiplier", 1, "1"),
            optional("offset", 1, "0"),
        ],
    ),
];

const JOINT_TYPES: [&str; 6] = [
    "revolute",
    "continuous",
    "fixed",
    "prismatic",
    "planar",
    "floating",
];

/// A posture that an MJCF names.
#[derive(Debug, Clone)]
pub struct Posture {
    pub name: String,
    /// Names of joints, each with its angle (rad).
    pub by_joint: Vec<(String, f64)>,
}

/// A robot as it was read, in the form of a URDF, with the line numbers of its links and joints.
pub struct Urdf {
    pub robot: urdf_rs::Robot,
    pub link_lines: Vec<usize>,
    pub joint_lines: Vec<usize>,
    /// Whether each joint names a parent and a child.
    pub is_whole: bool,
    /// The rotor inertia of each joint (kg m^2), 0 where none is stated, and postures. Only an MJCF states them; without it,
    /// there are none.
    pub rotor_inertias_kg_m2: Vec<f64>,
    pub postures: Vec<Posture>,
}

/// Reads a URDF, and adds the errors in its elements and attributes to `problems`. Fails if the text is not well-formed
/// XML with the root `robot`, or if it is too large or too deeply nested.
pub fn read(source: &Source, problems: &mut Problems) -> Result<Urdf> {
    let syntax = |message: String| Error::Syntax {
        file: source.file.clone(),
        message,
    };
    let document = xml_limits::of_file(&source.file, &source.text)?;
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        return Err(syntax(format!(
            "the root element is <{}>; accepted: <robot>",
            root.tag_name().name()
        )));
    }
    xml_limits::check_counts(&source.file, root, &MOST)?;
    let line_ends = source.text.match_indices('\n').map(|(at, _)| at).collect();
    let mut reader = Reader {
        problems,
        line_ends,
        text: String::new(),
        link_lines: Vec::new(),
        joint_lines: Vec::new(),
        is_whole: true,
    };
    reader.text = format!(
        "<robot name={}>",
        quoted(root.attribute("name").unwrap_or(""))
    );
    reader.children(&root, &root);
    reader.text.push_str("</robot>");
    let Reader {
        text,
        link_lines,
        joint_lines,
        is_whole,
        ..
    } = reader;
    let robot = urdf_rs::read_from_string(&text).map_err(|e| syntax(format!("not a URDF: {e}")))?;
    Ok(Urdf {
        robot,
        link_lines,
        joint_lines,
        is_whole,
        rotor_inertias_kg_m2: Vec::new(),
        postures: Vec::new(),
    })
}

/// Writes the text for urdf-rs.
struct Reader<'p, 'f> {
    problems: &'p mut Problems<'f>,
    /// Positions of the line breaks.
    line_ends: Vec<usize>,
    text: String,
    link_lines: Vec<usize>,
    joint_lines: Vec<usize>,
    is_whole: bool,
}

impl Reader<'_, '_> {
    fn line(&self, node: &Node) -> usize {
        1 + self
            .line_ends
            .partition_point(|&end| end < node.range().start)
    }

    /// Adds a problem such as `robot.urdf:12: joint left_knee: limit lower = abc: ...`. The `part` is the link or the
    /// joint that contains the node.
    fn bad(
        &mut self,
        part: &Node,
        node: &Node,
        name: &str,
        value: &str,
        problem: &str,
        accepted: &str,
    ) {
        let part_name = format!(
            "{} {}",
            part.tag_name().name(),
            part.attribute("name").unwrap_or("(unnamed)")
        );
        let field = match part == node {
            true => format!("{part_name}: {name}"),
            false => format!("{part_name}: {} {name}", node.tag_name().name()),
        };
        self.problems
            .add(self.line(node), field, value, problem, accepted);
    }

    /// Writes the elements in a node that this program reads.
    fn children(&mut self, part: &Node, node: &Node) {
        let mut written: Vec<&str> = Vec::new();
        for child in node.children().filter(Node::is_element) {
            let (tag, within) = (child.tag_name().name(), node.tag_name().name());
            let Some(element) = ELEMENTS
                .iter()
                .find(|e| e.name == tag && e.within.split(' ').any(|outer| outer == within))
            else {
                continue;
            };
            // A geometry has one shape.
            let is_first = element.repeats
                || !(written.contains(&tag) || within == "geometry" && !written.is_empty());
            let part = if within == "robot" { &child } else { part };
            if is_first && self.is_sound(part, &child) {
                written.push(tag);
                self.element(part, &child, element);
            }
        }
        if node.has_tag_name("inertial") {
            if !written.contains(&"mass") {
                self.text.push_str("<mass value=\"0\"/>");
            }
            if !written.contains(&"inertia") {
                self.text.push_str(
                    "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>",
                );
            }
        }
    }

    /// Whether a node has the elements without which it has no meaning.
    fn is_sound(&mut self, part: &Node, node: &Node) -> bool {
        let has = |outer: &Node, name: &str| outer.children().any(|inner| inner.has_tag_name(name));
        match node.tag_name().name() {
            "joint" => {
                for end in ["parent", "child"]
                    .into_iter()
                    .filter(|end| !has(node, end))
                {
                    self.bad(
                        part,
                        node,
                        end,
                        "(none)",
                        "is missing",
                        &format!("<{end} link=\"...\"/>"),
                    );
                    self.is_whole = false;
                }
                has(node, "parent") && has(node, "child")
            }
            "visual" | "collision" => {
                let shapes = ["box", "cylinder", "capsule", "sphere", "mesh"];
                let geometry = node.children().find(|inner| inner.has_tag_name("geometry"));
                let has_shape = geometry
                    .is_some_and(|geometry| shapes.iter().any(|shape| has(&geometry, shape)));
                if !has_shape && node.has_tag_name("collision") {
                    let kind = geometry.and_then(|geometry| geometry.first_element_child());
                    let value = kind.map_or("(none)", |shape| shape.tag_name().name());
                    self.bad(
                        part,
                        node,
                        "geometry",
                        value,
                        "is none of the known shapes",
                        &shapes.join(", "),
                    );
                }
                has_shape
            }
            "color" => node.has_attribute("rgba"),
            _ => true,
        }
    }

    fn element(&mut self, part: &Node, node: &Node, element: &Element) {
        match element.name {
            "link" => self.link_lines.push(self.line(node)),
            "joint" => self.joint_lines.push(self.line(node)),
            _ => {}
        }
        // Writing to a String cannot fail.
        _ = write!(self.text, "<{}", element.name);
        for attribute in element.attributes {
            let value = self.value(part, node, attribute);
            _ = write!(self.text, " {}={}", attribute.name, quoted(value));
        }
        self.text.push('>');
        self.children(part, node);
        if node.has_tag_name("joint")
            && node.attribute("type") == Some("revolute")
            && !node.children().any(|inner| inner.has_tag_name("limit"))
        {
            let accepted = "<limit lower upper effort velocity>";
            self.bad(part, node, "limit", "(none)", "is missing", accepted);
            self.text
                .push_str("<limit lower=\"-1\" upper=\"1\" effort=\"0\" velocity=\"0\"/>");
        }
        _ = write!(self.text, "</{}>", element.name);
    }

    /// The value of an attribute; a harmless one if it is missing or bad.
    fn value<'a>(&mut self, part: &Node, node: &Node<'a, '_>, attribute: &Attribute) -> &'a str {
        let Attribute {
            name,
            numbers: count,
            harmless,
            is_required,
        } = *attribute;
        let most = most(name);
        let finite = if most.is_finite() {
            format!("up to {most:e} in size")
        } else {
            "finite".into()
        };
        let counted = || match count {
            0 => "a name".to_string(),
            1 => format!("a number, {finite}"),
            _ => format!("{count} numbers, {finite}"),
        };
        let text = node
            .attribute(name)
            .filter(|text| count > 0 || !is_required || !text.is_empty());
        match text {
            None if is_required => self.bad(part, node, name, "(none)", "is missing", &counted()),
            None => {}
            Some(text) if name == "type" && !JOINT_TYPES.contains(&text) => {
                self.bad(
                    part,
                    node,
                    name,
                    text,
                    "this joint type is not supported",
                    &JOINT_TYPES.join(", "),
                );
            }
            Some(text) if count == 0 => return text,
            Some(text) => {
                let numbers = text.split_whitespace().map(str::parse::<f64>);
                if numbers.clone().count() == count
                    && numbers.clone().all(|n| n.is_ok_and(f64::is_finite))
                {
                    if numbers.flatten().all(|n| n.abs() <= most) {
                        return text;
                    }
                    self.bad(part, node, name, text, "is too large", &counted());
                } else {
                    self.bad(part, node, name, text, "cannot be read", &counted());
                }
            }
        }
        harmless
    }
}

/// Largest magnitude that an attribute accepts: masses of 10,000 tonnes, lengths of 10 km. Limits of joints have no
/// bound.
fn most(attribute: &str) -> f64 {
    match attribute {
        "xyz" | "rpy" | "size" | "radius" | "length" | "offset" => 1e4,
        "scale" => 1e6,
        "value" => 1e7,
        "ixx" | "ixy" | "ixz" | "iyy" | "iyz" | "izz" => 1e11,
        _ => f64::INFINITY,
    }
}

/// The pose of an `<origin>` (m).
pub fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let (xyz, rpy) = (Vector3::from(*pose.xyz), Vector3::from(*pose.rpy));
    let rotation = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
    Isometry3::from_parts(Translation3::from(xyz), rotation)
}

/// A text as the value of an attribute.
fn quoted(text: &str) -> String {
    let escaped = text
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;");
    format!("\"{escaped}\"")
}
