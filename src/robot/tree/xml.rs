//! A first check of the XML of a URDF. Its errors name line, element and attribute, as the parser of urdf-rs does not.

use crate::assets::Source;
use crate::error::{Error, Result};
use roxmltree::{Document, Node};

/// Element, its attributes, how many numbers each has, and whether they are required.
const NUMBERS: [(&str, &str, usize, bool); 12] = [
    ("origin", "xyz rpy", 3, false),
    ("axis", "xyz", 3, true),
    ("mass", "value", 1, true),
    ("inertia", "ixx ixy ixz iyy iyz izz", 1, true),
    ("limit", "lower upper", 1, false),
    ("limit", "effort velocity", 1, true),
    ("box", "size", 3, true),
    ("cylinder", "radius length", 1, true),
    ("sphere", "radius", 1, true),
    ("color", "rgba", 4, true),
    ("capsule", "radius length", 1, true),
    ("dynamics", "damping friction", 1, false),
];

/// Elements with an attribute that must be a name.
const NAMES: [(&str, &str); 4] = [("link", "name"), ("joint", "name"), ("parent", "link"), ("child", "link")];

/// Joint types that this program can simulate.
const JOINT_TYPES: &str = "revolute, fixed";

/// Checks that the text is well-formed XML with the root `robot`, that links and joints have the attributes that they
/// need, and that numbers are numbers.
pub(super) fn check(source: &Source) -> Result<()> {
    let syntax = |message: String| Error::Syntax { file: source.file.clone(), message };
    let document = Document::parse(&source.text).map_err(|e| syntax(format!("the XML is malformed: {e}")))?;
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        return Err(syntax(format!("the root element is <{}>; accepted: <robot>", root.tag_name().name())));
    }
    for part in root.children().filter(|n| n.has_tag_name("link") || n.has_tag_name("joint")) {
        for node in part.descendants().filter(Node::is_element) {
            check_element(source, &part, &node)?;
        }
        if part.has_tag_name("joint") {
            check_joint(source, &part)?;
        }
    }
    Ok(())
}

fn check_element(source: &Source, part: &Node, node: &Node) -> Result<()> {
    let tag = node.tag_name().name();
    for (_, name) in NAMES.iter().filter(|(t, _)| *t == tag) {
        if node.attribute(*name).unwrap_or("").is_empty() {
            return Err(bad(source, part, node, name, "(none)", "is missing", "a name"));
        }
    }
    let numbers = NUMBERS.iter().filter(|row| row.0 == tag);
    for (name, count, required) in
        numbers.flat_map(|(_, names, n, must)| names.split(' ').map(|name| (name, *n, *must)))
    {
        let accepted = || if count == 1 { "a number".to_string() } else { format!("{count} numbers") };
        match node.attribute(name) {
            None if required => return Err(bad(source, part, node, name, "(none)", "is missing", &accepted())),
            None => {}
            Some(text) => {
                let numbers = text.split_whitespace().map(str::parse::<f64>);
                if numbers.clone().count() != count || numbers.clone().any(|n| !n.is_ok_and(f64::is_finite)) {
                    let accepted = format!("{}, finite", accepted());
                    return Err(bad(source, part, node, name, text, "cannot be read", &accepted));
                }
            }
        }
    }
    Ok(())
}

fn check_joint(source: &Source, joint: &Node) -> Result<()> {
    let kind = joint.attribute("type").unwrap_or("(none)");
    if !JOINT_TYPES.split(", ").any(|accepted| accepted == kind) {
        return Err(bad(source, joint, joint, "type", kind, "this joint type is not supported", JOINT_TYPES));
    }
    for child in ["parent", "child"] {
        if !joint.children().any(|n| n.has_tag_name(child)) {
            return Err(bad(source, joint, joint, child, "(none)", "is missing", &format!("<{child} link=\"...\"/>")));
        }
    }
    if kind == "revolute" && !joint.children().any(|n| n.has_tag_name("limit")) {
        let accepted = "<limit lower upper effort velocity>";
        return Err(bad(source, joint, joint, "limit", "(none)", "is missing", accepted));
    }
    Ok(())
}

/// An error such as `robot.urdf:12: joint left_knee: limit lower = abc: ...`
fn bad(source: &Source, part: &Node, node: &Node, name: &str, value: &str, problem: &str, accepted: &str) -> Error {
    let line = node.document().text_pos_at(node.range().start).row;
    let part_name = format!("{} {}", part.tag_name().name(), part.attribute("name").unwrap_or("(unnamed)"));
    let field = if part == node {
        format!("{part_name}: {name}")
    } else {
        format!("{part_name}: {} {name}", node.tag_name().name())
    };
    Error::value(&format!("{}:{line}", source.file), field, value, problem, accepted)
}
