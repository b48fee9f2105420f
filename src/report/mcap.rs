//! The trace of an episode as an MCAP file, which Foxglove shows without any configuration: the robot moves in a 3D
//! panel with COM, DCM, ZMP and the forces, and every number can be plotted. All messages are JSON with a JSON schema.
//!
//! | topic | schema | how often |
//! |---|---|---|
//! | `/tf` | foxglove.FrameTransforms: each link in the frame `world` | every 10 ms |
//! | `/robot` | foxglove.SceneUpdate: the shapes of the links | once |
//! | `/forces` | foxglove.SceneUpdate: COM, DCM, ZMP as balls, forces as arrows, bob and rope of a pendulum | every 10 ms |
//! | `/joint_states` | foxglove.JointStates: angles, speeds and torques of the joints | every tick |
//! | `/joint_commands` | foxglove.JointStates: commands to the joints | every tick |
//! | `/trace` | standfast.Trace: the columns of the trace but those of joints, soles and base | every tick |
//!
//! The URDF of the robot is an attachment. The file is written in chunks while the episode runs, without a name, and
//! gets its name when it is whole: before that, an earlier file of this name stays.

use super::trace::Trace;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Foot, Kinematics, Pose, Robot, Shape, Solid};
use standfast_files::assets::{self, InputKind};
use standfast_files::columns::meaning;
use standfast_files::{AtomicFile, folder_of};
use standfast_scene::pendulum;
use standfast_sim::episode::Tick;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek};
use std::path::{Path, PathBuf};

/// Bytes of a chunk before compression.
const CHUNK: u64 = 1 << 18;
/// Time between two pictures (s), which is as short as a display can show.
const PICTURE_S: f64 = 0.01;
/// Radius of a ball, and diameter of an arrow, in COM heights.
const BALL: f64 = 0.03;
const ARROW: f64 = 0.02;
/// Length of the arrow of a force as large as the robot's weight, in COM heights.
const WEIGHT: f64 = 0.5;
const WORLD: &str = "world";

/// The kinds of shapes.
const KINDS: [&str; 4] = ["cubes", "spheres", "cylinders", "triangles"];

/// The topics, each with its schema.
const TOPICS: [(&str, &str); 6] = [
    ("/tf", "foxglove.FrameTransforms"),
    ("/robot", "foxglove.SceneUpdate"),
    ("/forces", "foxglove.SceneUpdate"),
    ("/joint_states", "foxglove.JointStates"),
    ("/joint_commands", "foxglove.JointStates"),
    ("/trace", "standfast.Trace"),
];

/// An MCAP file that is being written.
pub struct McapTrace<'a> {
    path: PathBuf,
    /// Writes to a file without a name in the folder of `path`. Such a file vanishes when the program ends, in whatever
    /// way.
    writer: Writer<File>,
    /// The number of each topic in the file, as in [`TOPICS`].
    channels: [u16; TOPICS.len()],
    robot: &'a Robot,
    /// The ticks as a table, whose last row is the next message of `/trace`.
    rows: Trace,
    /// Number of messages so far.
    written: u32,
    next_picture_s: f64,
    /// The first error. After it nothing more is written.
    failure: Option<Error>,
}

impl<'a> McapTrace<'a> {
    /// A new file with the robot's shapes and URDF.
    pub fn create(path: &Path, robot: &'a Robot) -> Result<Self> {
        let file = tempfile::tempfile_in(folder_of(path)).map_err(|source| Error::Write {
            path: path.into(),
            source,
        })?;
        let failed = |error| not_written(path, error);
        let options = WriteOptions::new()
            .library(concat!("standfast ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK))
            .disable_seeking(true);
        let mut writer = options.create(file).map_err(failed)?;
        let mut channels = [0; TOPICS.len()];
        for (channel, (topic, schema)) in channels.iter_mut().zip(TOPICS) {
            let of_schema = schema_of(schema).to_string();
            let id = writer
                .add_schema(schema, "jsonschema", of_schema.as_bytes())
                .map_err(failed)?;
            *channel = writer
                .add_channel(id, topic, "json", &BTreeMap::new())
                .map_err(failed)?;
        }
        let urdf = match &robot.urdf {
            // An MJCF is no URDF.
            Some(path) => assets::text(path)
                .ok()
                .filter(|source| !source.is_mjcf())
                .map(|source| source.text.into_bytes()),
            None => {
                let builtin = assets::open(InputKind::Robot, &robot.name)
                    .ok()
                    .filter(|source| source.is_builtin());
                builtin.map(|source| source.text.into_bytes())
            }
        };
        if let Some(urdf) = urdf {
            let attachment = Attachment {
                log_time: 0,
                create_time: 0,
                name: format!("{}.urdf", robot.name),
                media_type: "application/xml".into(),
                data: urdf.into(),
            };
            writer.attach(&attachment).map_err(failed)?;
        }
        let facts = [
            ("robot", robot.name.clone()),
            ("mass_kg", robot.mass().to_string()),
        ];
        let metadata = facts.map(|(key, value)| (key.to_string(), value)).into();
        writer
            .write_metadata(&Metadata {
                name: "standfast".into(),
                metadata,
            })
            .map_err(failed)?;
        let (path, rows) = (path.into(), Trace::new(robot));
        let mut trace = Self {
            path,
            writer,
            channels,
            robot,
            rows,
            written: 0,
            next_picture_s: 0.0,
            failure: None,
        };
        trace.write("/robot", 0, &shapes(robot))?;
        Ok(trace)
    }

    /// Adds a tick. If the tick cannot be written, [`finish`](Self::finish) fails.
    pub fn push(&mut self, tick: &Tick) {
        if self.failure.is_none() {
            self.failure = self.add(tick).err();
        }
    }

    fn add(&mut self, tick: &Tick) -> Result<()> {
        let (truth, robot) = (tick.truth, self.robot);
        self.rows.push(tick);
        let nanoseconds = (1e9 * truth.time_s).round() as u64;
        let at = timestamp(nanoseconds);
        let joints = |values: &dyn Fn(usize) -> Value| {
            let mut states = Vec::new();
            for (j, joint) in robot.joints.iter().enumerate() {
                let mut state = values(j);
                state["name"] = json!(joint.name);
                states.push(state);
            }
            json!({ "timestamp": at, "joints": states })
        };
        let states = joints(
            &|j| json!({ "position": truth.posture.q[j], "velocity": truth.velocity[6 + j], "effort": truth.tau[j] }),
        );
        let commands = joints(
            &|j| json!({ "position": tick.command.q_ref[j], "velocity": tick.command.dq_ref[j] }),
        );
        let mut row = self.rows.last_row();
        row.insert("timestamp".into(), at.clone());
        if truth.time_s >= self.next_picture_s {
            self.next_picture_s = truth.time_s + PICTURE_S * (1.0 - 1e-6);
            self.write("/tf", nanoseconds, &transforms(robot, tick, &at))?;
            self.write("/forces", nanoseconds, &forces(robot, tick, &at))?;
        }
        self.write("/joint_states", nanoseconds, &states)?;
        self.write("/joint_commands", nanoseconds, &commands)?;
        self.write("/trace", nanoseconds, &Value::Object(row))
    }

    /// Ends the file with its index, and gives it its name. If any part could not be written, it fails and leaves
    /// nothing.
    pub fn finish(mut self) -> Result<()> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        self.writer
            .finish()
            .map_err(|error| not_written(&self.path, error))?;
        let mut written = self.writer.into_inner();
        let mut named = AtomicFile::create(&self.path)?;
        let copied = written
            .rewind()
            .and_then(|()| io::copy(&mut written, &mut named));
        copied.map_err(|source| Error::Write {
            path: self.path,
            source,
        })?;
        named.commit()
    }

    /// Writes a message on one of [`TOPICS`], with a time in nanoseconds.
    fn write(&mut self, topic: &str, log_time: u64, message: &Value) -> Result<()> {
        let number = TOPICS
            .iter()
            .position(|(name, _)| *name == topic)
            .expect("it is one of the topics");
        let (channel_id, sequence) = (self.channels[number], self.written);
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time: log_time,
        };
        self.written += 1;
        let written = self
            .writer
            .write_to_known_channel(&header, message.to_string().as_bytes());
        written.map_err(|error| not_written(&self.path, error))
    }
}

fn not_written(path: &Path, error: McapError) -> Error {
    let source = match error {
        McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    Error::Write {
        path: path.into(),
        source,
    }
}

fn timestamp(nanoseconds: u64) -> Value {
    json!({ "sec": nanoseconds / 1_000_000_000, "nsec": nanoseconds % 1_000_000_000 })
}

fn xyz(v: Vector3<f64>) -> Value {
    json!({ "x": v.x, "y": v.y, "z": v.z })
}

fn pose(pose: &Pose) -> Value {
    let r = pose.rotation;
    json!({ "position": xyz(pose.translation.vector), "orientation": { "x": r.i, "y": r.j, "z": r.k, "w": r.w } })
}

fn color([r, g, b, a]: [f64; 4]) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": a })
}

fn transforms(robot: &Robot, tick: &Tick, at: &Value) -> Value {
    let kinematics = Kinematics::at(robot, &tick.truth.posture);
    let mut transforms = Vec::new();
    for (i, link) in robot.links.iter().enumerate() {
        let placed = pose(kinematics.link_pose(i));
        transforms.push(json!({
            "timestamp": at,
            "parent_frame_id": WORLD,
            "child_frame_id": link.name,
            "translation": placed["position"],
            "rotation": placed["orientation"],
        }));
    }
    json!({ "transforms": transforms })
}

/// An entity of a scene. A later message with the same `id` replaces it.
fn entity(id: &str, frame: &str, at: &Value, parts: &[(&str, Vec<Value>)]) -> Value {
    let mut entity = json!({
        "id": id, "frame_id": frame, "timestamp": at, "lifetime": timestamp(0), "frame_locked": true, "metadata": [],
        "arrows": [], "cubes": [], "spheres": [], "cylinders": [], "lines": [], "triangles": [], "texts": [], "models": [],
    });
    for (kind, values) in parts {
        entity[kind] = json!(values);
    }
    entity
}

fn shapes(robot: &Robot) -> Value {
    let at = timestamp(0);
    let mut entities = Vec::new();
    for link in &robot.links {
        let mut parts = KINDS.map(|kind| (kind, Vec::new()));
        for solid in link.drawn() {
            let (kind, shape) = shape(solid);
            parts[kind].1.push(shape);
        }
        entities.push(entity(&link.name, &link.name, &at, &parts));
    }
    json!({ "deletions": [], "entities": entities })
}

/// The shape of a solid, and the number of its kind in [`KINDS`].
fn shape(solid: &Solid) -> (usize, Value) {
    let (at, paint) = (pose(&solid.pose), color(solid.color));
    let sized = |kind: usize, x: f64, y: f64, z: f64| {
        (
            kind,
            json!({ "pose": at, "size": xyz(Vector3::new(x, y, z)), "color": paint }),
        )
    };
    match &solid.shape {
        Shape::Box { half } => sized(0, 2.0 * half.x, 2.0 * half.y, 2.0 * half.z),
        Shape::Sphere { radius } => sized(1, 2.0 * radius, 2.0 * radius, 2.0 * radius),
        Shape::Cylinder { radius, length } => {
            let (kind, mut cylinder) = sized(2, 2.0 * radius, 2.0 * radius, *length);
            (cylinder["bottom_scale"], cylinder["top_scale"]) = (json!(1.0), json!(1.0));
            (kind, cylinder)
        }
        // Foxglove has no capsule; a stretched ball is similar.
        Shape::Capsule { radius, length } => {
            sized(1, 2.0 * radius, 2.0 * radius, length + 2.0 * radius)
        }
        Shape::Mesh(mesh) => {
            let points: Vec<Value> = mesh.points.iter().map(|point| xyz(point.coords)).collect();
            let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
            (
                3,
                json!({ "pose": at, "points": points, "color": paint, "colors": [], "indices": indices }),
            )
        }
    }
}

fn forces(robot: &Robot, tick: &Tick, at: &Value) -> Value {
    let (truth, height) = (tick.truth, robot.home_com_height());
    let weight_n = robot.weight_n();
    let ball = |place: Point3<f64>, paint: [f64; 4]| {
        let size = xyz(Vector3::repeat(BALL * height));
        json!({ "pose": pose(&Pose::translation(place.x, place.y, place.z)), "size": size, "color": color(paint) })
    };
    let on_ground = |x: f64, y: f64| Point3::new(x, y, truth.ground.height_m([x, y].into()));
    let mut balls = vec![
        ball(truth.com, [0.9, 0.9, 0.9, 1.0]),
        ball(on_ground(tick.dcm.x, tick.dcm.y), [0.9, 0.2, 0.2, 1.0]),
    ];
    balls.extend(
        truth
            .zmp
            .map(|[x, y]| ball(on_ground(x, y), [0.2, 0.4, 0.9, 1.0])),
    );
    let arrow = |from: Point3<f64>, force_n: Vector3<f64>, paint: [f64; 4]| {
        let along = UnitQuaternion::rotation_between(&Vector3::x(), &force_n);
        let turned = Pose::from_parts(from.into(), along.unwrap_or_default());
        let length_m = WEIGHT * height * force_n.norm() / weight_n;
        json!({
            "pose": pose(&turned), "shaft_length": 0.8 * length_m, "shaft_diameter": ARROW * height,
            "head_length": 0.2 * length_m, "head_diameter": 2.0 * ARROW * height, "color": color(paint),
        })
    };
    let mut arrows = Vec::new();
    for foot in Foot::BOTH {
        let force = truth.sole_wrenches[foot].force;
        if force.norm() > 1e-3 * weight_n {
            arrows.push(arrow(
                truth.soles[foot].translation.vector.into(),
                force,
                [0.2, 0.7, 0.3, 1.0],
            ));
        }
    }
    if truth.push_force.norm() > 0.0 {
        arrows.push(arrow(
            truth.push_point,
            truth.push_force,
            [0.9, 0.5, 0.1, 1.0],
        ));
    }
    let mut entities = vec![entity(
        "forces",
        WORLD,
        at,
        &[("spheres", balls), ("arrows", arrows)],
    )];
    if let Some(strike) = &truth.strike {
        // Without parts it replaces the last bob, which is then gone.
        let mut parts = KINDS.map(|kind| (kind, Vec::new()));
        if let Some(rope) = truth.rope() {
            for mut solid in pendulum::solids(strike.bob()) {
                solid.pose = pendulum::pose(rope) * solid.pose;
                let (kind, shape) = shape(&solid);
                parts[kind].1.push(shape);
            }
        }
        entities.push(entity("pendulum", WORLD, at, &parts));
    }
    json!({ "deletions": [], "entities": entities })
}

/// The JSON schema of a message. Foxglove uses its name; the properties tell a reader what to plot.
fn schema_of(name: &str) -> Value {
    let object = |properties: Value| json!({ "type": "object", "properties": properties });
    let [number, text] = ["number", "string"].map(|kind| json!({ "type": kind }));
    let list = |items: Value| json!({ "type": "array", "items": items });
    let time = object(json!({ "sec": { "type": "integer" }, "nsec": { "type": "integer" } }));
    let vector = object(json!({ "x": number, "y": number, "z": number }));
    let turn = object(json!({ "x": number, "y": number, "z": number, "w": number }));
    let properties = match name {
        "foxglove.FrameTransforms" => json!({ "transforms": list(object(json!({
            "timestamp": time, "parent_frame_id": text, "child_frame_id": text, "translation": vector, "rotation": turn,
        }))) }),
        "foxglove.SceneUpdate" => {
            json!({ "deletions": list(object(json!({}))), "entities": list(object(json!({}))) })
        }
        "foxglove.JointStates" => json!({ "timestamp": time, "joints": list(object(json!({
            "name": text, "position": number, "velocity": number, "effort": number,
        }))) }),
        _ => {
            let mut properties = Map::new();
            for name in Trace::names_of_body() {
                let kind = if name == "phase" || name == "links_met" {
                    "string"
                } else {
                    "number"
                };
                properties.insert(
                    name.to_string(),
                    json!({ "type": [kind, "null"], "description": meaning(name) }),
                );
            }
            properties.insert("timestamp".into(), time);
            Value::Object(properties)
        }
    };
    let mut schema = object(properties);
    schema["title"] = json!(name);
    schema
}
