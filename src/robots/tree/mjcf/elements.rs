//! The elements of an MJCF: their attributes, own or of default classes, and the poses that these state.

use crate::tree::problems::Problems;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::Node;
use std::cell::RefCell;
use std::collections::HashMap;

/// The elements of actuators, which share their defaults.
const ACTUATORS: [&str; 9] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
];

/// An element, with the `childclass` of what is around it.
#[derive(Debug, Clone, Copy)]
pub struct Element<'a> {
    pub node: Node<'a, 'a>,
    pub childclass: Option<&'a str>,
}

/// A document with its default classes, and where its problems go.
pub struct Mjcf<'a, 'f> {
    pub root: Node<'a, 'a>,
    pub problems: RefCell<&'a mut Problems<'f>>,
    /// Whether the lines of the text are those of the file.
    pub has_lines: bool,
    /// The class of what names none.
    root_class: &'a str,
    /// The class around each class.
    outer: HashMap<&'a str, Option<&'a str>>,
    /// The elements of each class, by their kind.
    defaults: HashMap<(&'a str, &'a str), Vec<Node<'a, 'a>>>,
    is_degree: bool,
    eulerseq: &'a str,
}

/// The kind of an element, under which its defaults stand.
fn kind<'a>(node: Node<'a, 'a>) -> &'a str {
    match node.tag_name().name() {
        name if ACTUATORS.contains(&name) => "actuator",
        _ if node
            .parent()
            .is_some_and(|outer| outer.has_tag_name("equality")) =>
        {
            "equality"
        }
        name => name,
    }
}

/// The numbers of a text. None if one cannot be read or is too large.
fn parsed(name: &str, text: &str) -> Option<Vec<f64>> {
    let most = match name {
        "pos" | "size" | "fromto" => 1e4,
        "mass" | "density" => 1e7,
        "scale" | "refpos" => 1e6,
        _ => 1e11,
    };
    let numbers = text.split_whitespace().map(str::parse::<f64>);
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().ok()?;
    numbers.iter().all(|x| x.abs() <= most).then_some(numbers)
}

impl<'a, 'f> Mjcf<'a, 'f> {
    pub fn of(root: Node<'a, 'a>, has_lines: bool, problems: &'a mut Problems<'f>) -> Self {
        let mut mjcf = Self {
            root,
            problems: RefCell::new(problems),
            has_lines,
            root_class: "main",
            outer: HashMap::new(),
            defaults: HashMap::new(),
            is_degree: true,
            eulerseq: "xyz",
        };
        let mut of_root = root.children().filter(|node| node.has_tag_name("default"));
        if let Some(name) = of_root.clone().find_map(|node| node.attribute("class")) {
            mjcf.root_class = name;
        }
        mjcf.outer.insert(mjcf.root_class, None);
        let classes: Vec<_> = of_root.by_ref().collect();
        for class in classes {
            mjcf.add_class(class, None);
        }
        mjcf.is_degree = mjcf.setting("angle") != Some("radian");
        mjcf.eulerseq = mjcf.setting("eulerseq").unwrap_or("xyz");
        if !mjcf.eulerseq.chars().all(|c| "xyzXYZ".contains(c)) || mjcf.eulerseq.len() != 3 {
            let accepted = "three of x, y, z (turning axes) and X, Y, Z (fixed ones)";
            mjcf.bad(
                root,
                "compiler eulerseq",
                mjcf.eulerseq,
                "cannot be read",
                accepted,
            );
            mjcf.eulerseq = "xyz";
        }
        mjcf
    }

    fn add_class(&mut self, class: Node<'a, 'a>, outer: Option<&'a str>) {
        let name = class
            .attribute("class")
            .or(outer)
            .unwrap_or(self.root_class);
        let around = outer.unwrap_or(self.root_class);
        // The first one counts, so that no class is within itself.
        self.outer.entry(name).or_insert(Some(around));
        for node in class.children().filter(Node::is_element) {
            if node.has_tag_name("default") {
                self.add_class(node, Some(name));
            } else {
                self.defaults
                    .entry((name, kind(node)))
                    .or_default()
                    .push(node);
            }
        }
    }

    /// A setting of the last `<compiler>` that states it.
    pub fn setting(&self, name: &str) -> Option<&'a str> {
        let compilers = self
            .root
            .children()
            .filter(|node| node.has_tag_name("compiler"));
        compilers
            .filter_map(|node| node.attribute(name))
            .next_back()
    }

    /// The elements of all sections of a name, such as `actuator`.
    pub fn section(&self, name: &'static str) -> impl Iterator<Item = Element<'a>> {
        let sections = self
            .root
            .children()
            .filter(move |node| node.has_tag_name(name));
        let elements = sections.flat_map(|section| section.children().filter(Node::is_element));
        elements.map(|node| Element {
            node,
            childclass: None,
        })
    }

    /// The line of an element; 0 if it is not known.
    pub fn line(&self, node: Node) -> usize {
        match self.has_lines {
            true => node.document().text_pos_at(node.range().start).row as usize,
            false => 0,
        }
    }

    /// Adds a problem of an element.
    pub fn bad(
        &self,
        node: Node,
        field: impl Into<String>,
        value: impl ToString,
        problem: &str,
        accepted: &str,
    ) {
        let line = self.line(node);
        self.problems
            .borrow_mut()
            .add(line, field, value, problem, accepted);
    }

    pub fn note(&self, note: String) {
        self.problems.borrow_mut().notes.push(note);
    }

    /// An attribute of an element, its own or that of its class.
    pub fn text(&self, element: Element<'a>, name: &str) -> Option<&'a str> {
        if let Some(own) = element.node.attribute(name) {
            return Some(own);
        }
        let kind = kind(element.node);
        let mut class = element.node.attribute("class").or(element.childclass);
        class = class
            .filter(|class| self.outer.contains_key(class))
            .or(Some(self.root_class));
        while let Some(of) = class {
            let nodes = self.defaults.get(&(of, kind)).into_iter().flatten().rev();
            if let Some(value) = nodes.filter_map(|node| node.attribute(name)).next() {
                return Some(value);
            }
            class = self.outer.get(of).copied().flatten();
        }
        None
    }

    /// Reports a class that is not there.
    pub fn check_class(&self, element: Element<'a>) {
        let named = element.node.attribute("class").or(element.childclass);
        if let Some(name) = named.filter(|name| !self.outer.contains_key(name)) {
            let field = format!("{}: class", self.named(element.node));
            self.bad(
                element.node,
                field,
                name,
                "no such class",
                "a class of <default>",
            );
        }
    }

    /// An element in words.
    pub fn named(&self, node: Node) -> String {
        let tag = node.tag_name().name();
        match node.attribute("name") {
            Some(name) => format!("{tag} {name}"),
            None => {
                let holder = node.parent().and_then(|body| body.attribute("name"));
                holder.map_or(tag.into(), |body| format!("{tag} of {body}"))
            }
        }
    }

    /// The numbers of an attribute, `least` of them or more. A problem if they cannot be read.
    pub fn list(&self, element: Element<'a>, name: &str, least: usize) -> Option<Vec<f64>> {
        let text = self.text(element, name)?;
        let numbers = parsed(name, text).filter(|numbers| numbers.len() >= least);
        if numbers.is_none() {
            let field = format!("{}: {name}", self.named(element.node));
            let problem = "cannot be read, or is too large";
            self.bad(
                element.node,
                field,
                text,
                problem,
                &format!("numbers, {least} at least"),
            );
        }
        numbers
    }

    /// The `N` numbers of an attribute.
    pub fn numbers<const N: usize>(&self, element: Element<'a>, name: &str) -> Option<[f64; N]> {
        let list = self.list(element, name, N)?;
        list.first_chunk().copied()
    }

    pub fn number(&self, element: Element<'a>, name: &str) -> Option<f64> {
        self.numbers(element, name).map(|[number]| number)
    }

    pub fn vector(&self, element: Element<'a>, name: &str) -> Option<Vector3<f64>> {
        self.numbers::<3>(element, name).map(Vector3::from)
    }

    /// Radians of an angle of the file.
    pub fn radians(&self, angle: f64) -> f64 {
        if self.is_degree {
            angle.to_radians()
        } else {
            angle
        }
    }

    /// The range of an attribute if the element is limited to it.
    pub fn range(&self, element: Element<'a>, limited: &str, range: &str) -> Option<[f64; 2]> {
        let holds = match self.text(element, limited) {
            Some("true") => true,
            Some("false") => false,
            _ => self.setting("autolimits") != Some("false"),
        };
        // Without a word whether it holds, 0 0 is how a file takes back the range of a class.
        let is_taken_back =
            |range: &[f64; 2]| *range == [0.0; 2] && self.text(element, limited) != Some("true");
        let range = holds.then(|| self.numbers(element, range)).flatten();
        range.filter(|range| !is_taken_back(range))
    }

    /// The pose of an element in what is around it (m).
    pub fn pose(&self, element: Element<'a>) -> Isometry3<f64> {
        let at = self.vector(element, "pos").unwrap_or_default();
        Isometry3::from_parts(Translation3::from(at), self.turn(element))
    }

    /// The orientation of an element.
    fn turn(&self, element: Element<'a>) -> UnitQuaternion<f64> {
        if let Some([x, y, z, angle]) = self.numbers(element, "axisangle") {
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-12).unwrap_or(Vector3::z_axis());
            return UnitQuaternion::from_axis_angle(&axis, self.radians(angle));
        }
        if let Some(angles) = self.numbers::<3>(element, "euler") {
            let mut turn = UnitQuaternion::identity();
            for (axis, angle) in self.eulerseq.chars().zip(angles) {
                let about = match axis.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    _ => Vector3::z_axis(),
                };
                let next = UnitQuaternion::from_axis_angle(&about, self.radians(angle));
                turn = if axis.is_lowercase() {
                    turn * next
                } else {
                    next * turn
                };
            }
            return turn;
        }
        if let Some([a, b, c, d, e, f]) = self.numbers(element, "xyaxes") {
            let (x, y) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            let (x, z) = (x.try_normalize(1e-12), x.cross(&y).try_normalize(1e-12));
            if let (Some(x), Some(z)) = (x, z) {
                let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
                return UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                    axes,
                ));
            }
        }
        if let Some(z) = self.vector(element, "zaxis") {
            return turn_of_z(&z);
        }
        let [w, x, y, z] = self
            .numbers(element, "quat")
            .unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let quaternion = nalgebra::Quaternion::new(w, x, y, z);
        UnitQuaternion::try_new(quaternion, 1e-12).unwrap_or_default()
    }
}

/// The least rotation that brings the z axis into a direction.
pub fn turn_of_z(direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    UnitQuaternion::rotation_between(&Vector3::z(), direction).unwrap_or(down)
}

/// The `<origin>` of a URDF. Yaw is found first, and the others from what it leaves, so that the product is exact where
/// the pitch is a right angle.
pub fn origin(pose: &Isometry3<f64>) -> urdf_rs::Pose {
    let turn = pose.rotation.to_rotation_matrix();
    let yaw = turn[(1, 0)].atan2(turn[(0, 0)]);
    let rest = Rotation3::from_axis_angle(&Vector3::z_axis(), -yaw) * turn;
    let pitch = (-rest[(2, 0)]).atan2(rest[(0, 0)]);
    let roll = (-rest[(1, 2)]).atan2(rest[(1, 1)]);
    urdf_rs::Pose {
        xyz: urdf_rs::Vec3(pose.translation.vector.into()),
        rpy: urdf_rs::Vec3([roll, pitch, yaw]),
    }
}

/// A body of the file, also one that does not belong to the robot.
pub struct Body<'a> {
    pub node: Node<'a, 'a>,
    pub name: String,
    pub parent: Option<usize>,
    /// Its pose in the parent (m).
    pub pose: Isometry3<f64>,
    /// Its joints, geoms, sites and inertials, each with the frame around it in the body.
    pub elements: Vec<(Element<'a>, Isometry3<f64>)>,
}

impl<'a> Body<'a> {
    pub fn of(&self, tag: &'static str) -> impl Iterator<Item = &(Element<'a>, Isometry3<f64>)> {
        self.elements
            .iter()
            .filter(move |(element, _)| element.node.has_tag_name(tag))
    }

    /// Its joints in the order of the file, the free one included.
    pub fn joints(&self) -> impl Iterator<Item = (Element<'a>, Isometry3<f64>)> {
        let is_joint = |node: &Node| node.has_tag_name("joint") || node.has_tag_name("freejoint");
        self.elements
            .iter()
            .filter(move |(element, _)| is_joint(&element.node))
            .copied()
    }

    /// The name of its joint `k`.
    pub fn joint_name(&self, k: usize) -> String {
        let named = self
            .joints()
            .nth(k)
            .and_then(|(joint, _)| joint.node.attribute("name"));
        named.map_or_else(|| format!("joint {k} of {}", self.name), str::to_string)
    }
}

/// The type of a joint: `hinge`, `slide`, `ball` or `free`.
pub fn joint_kind<'a>(mjcf: &Mjcf<'a, '_>, joint: Element<'a>) -> &'a str {
    match joint.node.has_tag_name("freejoint") {
        true => "free",
        false => mjcf.text(joint, "type").unwrap_or("hinge"),
    }
}
