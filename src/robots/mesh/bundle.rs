//! The meshes of a robot as one text, which a result keeps so that it needs no other file. Its numbers read back to the
//! bit.
//!
//! ```text
//! mesh 1 1 1 package://adult/meshes/torso.obj    scale along the axes, and name in the URDF
//! hull 0.1 0.2 0.3                               point of the hull that collides (m)
//! point 0.1 0.2 0.3                              corner of the triangles that are drawn (m)
//! triangle 0 1 2                                 indices of corners, from 0 in each mesh
//! ```

use nalgebra::Point3;
use standfast_core::robot::mesh::Mesh;
use standfast_files::assets;
use std::fmt::Write;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

/// A mesh as a URDF names it: the file, and the bits of the scale along its axes.
pub type Named = (String, [u64; 3]);

/// Largest size of a text of meshes (bytes).
const MOST_BYTES: u64 = 50_000_000;

/// The text of the meshes of a URDF file that is kept beside it: `robot.meshes` for `robot.urdf`. It is None if there
/// is no such file. Fails, in words, if the file cannot be read.
pub fn beside(urdf: &Path) -> Option<Result<String, String>> {
    let path = urdf.with_extension("meshes");
    path.is_file().then(|| {
        let bytes = assets::read(&path, MOST_BYTES).map_err(|e| e.to_string())?;
        String::from_utf8(bytes).map_err(|_| format!("{}: it is not text in UTF-8", path.display()))
    })
}

/// The text of some meshes, in their order.
pub fn text(meshes: &[(Named, Arc<Mesh>)]) -> String {
    let mut text = String::new();
    let mut line = |word: &str, [x, y, z]: [f64; 3], rest: &str| {
        _ = writeln!(text, "{word} {x} {y} {z}{rest}")
    };
    for ((name, scale), mesh) in meshes {
        line("mesh", scale.map(f64::from_bits), &format!(" {name}"));
        for point in &mesh.hull {
            line("hull", point.coords.into(), "");
        }
        for point in &mesh.points {
            line("point", point.coords.into(), "");
        }
        for corners in &mesh.triangles {
            line("triangle", corners.map(f64::from), "");
        }
    }
    text
}

/// The meshes of a text. Fails, in words, if a line is wrong or a mesh is not whole.
pub fn read(text: &str) -> Result<Vec<(Named, Arc<Mesh>)>, String> {
    let mut meshes: Vec<(Named, Mesh)> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        add(&mut meshes, line)
            .ok_or_else(|| format!("line {}: `{line}` is not understood", number + 1))?;
    }
    for ((name, _), mesh) in &meshes {
        let mut corners = mesh.triangles.iter().flatten();
        if mesh.hull.is_empty() || corners.any(|&i| i as usize >= mesh.points.len()) {
            return Err(format!("the mesh {name} is not whole"));
        }
    }
    Ok(meshes
        .into_iter()
        .map(|(named, mesh)| (named, Arc::new(mesh)))
        .collect())
}

/// Adds what a line says. It is None if the line is wrong.
fn add(meshes: &mut Vec<(Named, Mesh)>, line: &str) -> Option<()> {
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    match (word, meshes.last_mut()) {
        ("mesh", _) => meshes.push((
            named(rest)?,
            Mesh {
                points: Vec::new(),
                triangles: Vec::new(),
                hull: Vec::new(),
            },
        )),
        ("hull", Some((_, mesh))) => mesh.hull.push(point(rest)?),
        ("point", Some((_, mesh))) => mesh.points.push(point(rest)?),
        ("triangle", Some((_, mesh))) => mesh.triangles.push(triple(rest)?),
        _ => return None,
    }
    Some(())
}

fn named(rest: &str) -> Option<Named> {
    let mut words = rest.splitn(4, ' ');
    let mut number = || words.next()?.parse().ok().map(f64::to_bits);
    let scale = [number()?, number()?, number()?];
    Some((words.next()?.into(), scale))
}

fn triple<T: FromStr>(rest: &str) -> Option<[T; 3]> {
    let numbers: Vec<T> = rest
        .split(' ')
        .map(str::parse)
        .collect::<Result<_, _>>()
        .ok()?;
    numbers.try_into().ok()
}

fn point(rest: &str) -> Option<Point3<f64>> {
    triple(rest)
        .filter(|xyz: &[f64; 3]| xyz.iter().all(|x| x.is_finite()))
        .map(Point3::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_read_back_to_the_bit() {
        let corners = [
            [0.1 + 0.2, 1e-300, -0.0],
            [1.0 / 3.0, -7.5, 0.0],
            [0.0, 2e9, 1e-9],
            [0.5, 0.25, 4.0],
        ];
        let mesh = Mesh::new(
            corners.map(Point3::from).to_vec(),
            vec![[0, 1, 2], [3, 2, 1]],
        );
        let named = |name: &str| (name.to_string(), [0.001, -1.0, 1.0].map(f64::to_bits));
        let meshes = [
            (named("package://a b/c.stl"), Arc::new(mesh.clone())),
            (named("d.obj"), Arc::new(mesh)),
        ];
        let again = read(&text(&meshes)).unwrap();
        assert_eq!(format!("{again:?}"), format!("{meshes:?}"));
        assert_eq!(text(&again), text(&meshes));
    }

    #[test]
    fn what_is_wrong_with_kept_meshes_is_told() {
        for (text, expected) in [
            ("hull 0 0 0", "line 1: `hull 0 0 0` is not understood"),
            ("mesh 1 1 1 a\nhull 0 0", "line 2"),
            ("mesh 1 1 1 a\nhull 0 0 NaN", "line 2"),
            (
                "mesh 1 1 1 a\nhull 0 0 0\ntriangle 0 0 0",
                "the mesh a is not whole",
            ),
            ("mesh 1 1 1 a", "the mesh a is not whole"),
        ] {
            let problem = read(text).unwrap_err();
            assert!(problem.contains(expected), "{expected}: {problem}");
        }
    }
}
