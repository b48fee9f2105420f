//! Reads meshes from STL and OBJ files, and from COLLADA by [`super::dae`]. Errors are in words.

use super::Triangles;
use super::dae;
use nalgebra::Point3;
use standfast_files::assets;
use std::path::Path;
use std::str::{FromStr, SplitWhitespace};

const MOST_BYTES: u64 = 200_000_000;
/// Beginning of a file with which Git LFS replaces a file that was not fetched.
const LFS_POINTER: &[u8] = b"version https://git-lfs";

/// Reads a mesh in the format of its extension.
pub fn read(path: &Path) -> Result<Triangles, String> {
    let extension = path
        .extension()
        .map(|extension| extension.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let parse = match extension.as_str() {
        "stl" => stl,
        "obj" => |bytes: &[u8]| obj(utf8(bytes)?),
        "dae" => |bytes: &[u8]| dae::read(utf8(bytes)?),
        _ => return Err("its format is not supported; accepted: .stl, .obj, .dae".into()),
    };
    let bytes = assets::read(path, MOST_BYTES).map_err(|e| e.to_string())?;
    let mesh = parse(&bytes)?;
    let count = mesh.points.len();
    if mesh.triangles.is_empty() {
        return Err("it has no triangles".into());
    }
    if mesh
        .triangles
        .iter()
        .flatten()
        .any(|&corner| corner as usize >= count)
    {
        return Err("a triangle names a corner that does not exist".into());
    }
    if mesh
        .points
        .iter()
        .any(|point| point.iter().any(|x| x.is_nan() || x.abs() > 1e9))
    {
        return Err("a coordinate is not a number or too large".into());
    }
    // A shape that was rounded to nothing would be a speck on which a foot stands.
    let (least, most) = standfast_core::robot::mesh::bounds(&mesh.points);
    if (most - least).norm() <= 1e-9 * least.coords.norm() {
        return Err("all of its corners coincide".into());
    }
    Ok(mesh)
}

/// Whether a file replaces one that Git LFS has not fetched.
pub fn is_lfs_pointer(path: &Path) -> bool {
    let is_small = path.metadata().is_ok_and(|file| file.len() < 1000);
    is_small && assets::read(path, 1000).is_ok_and(|bytes| bytes.starts_with(LFS_POINTER))
}

fn utf8(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|_| "it is not text in UTF-8".into())
}

/// STL, binary or as text. It has three corners for each triangle.
fn stl(bytes: &[u8]) -> Result<Triangles, String> {
    let points = match stl_binary(bytes) {
        Some(points) => points,
        None if bytes.trim_ascii_start().starts_with(b"solid") => {
            stl_text(&String::from_utf8_lossy(bytes))?
        }
        None => return Err("it is not an STL file, or one that is cut off".into()),
    };
    let triangles = (0..points.len() as u32 / 3)
        .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
        .collect();
    Ok(Triangles { points, triangles })
}

/// The corners of a binary STL file: a head of 80 bytes, the number of triangles, and 50 bytes for each triangle. None
/// if the file is shorter than its head says.
fn stl_binary(bytes: &[u8]) -> Option<Vec<Point3<f64>>> {
    let count = u32::from_le_bytes(bytes.get(80..84)?.try_into().ok()?) as usize;
    let triangles = bytes.get(84..84 + 50 * count)?;
    // A text may happen to state a small enough number of triangles here, but its length then differs.
    if bytes.starts_with(b"solid") && bytes.len() != 84 + 50 * count {
        return None;
    }
    let number =
        |bytes: &[u8]| f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    // The first three numbers of a triangle are its normal.
    let corners = triangles
        .chunks_exact(50)
        .flat_map(|triangle| triangle[12..48].chunks_exact(12));
    Some(
        corners
            .map(|xyz| Point3::new(number(xyz), number(&xyz[4..]), number(&xyz[8..])))
            .collect(),
    )
}

fn stl_text(text: &str) -> Result<Vec<Point3<f64>>, String> {
    let mut points = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words
            .next()
            .is_some_and(|word| word.eq_ignore_ascii_case("vertex"))
        {
            points.push(
                point(&mut words).ok_or_else(|| {
                    format!("line {}: a vertex without three numbers", number + 1)
                })?,
            );
        }
    }
    if points.len() % 3 == 0 {
        Ok(points)
    } else {
        Err("a triangle does not have three corners".into())
    }
}

/// OBJ: its corners and faces. All else is ignored.
fn obj(text: &str) -> Result<Triangles, String> {
    let mut mesh = Triangles::default();
    for (number, line) in text.lines().enumerate() {
        let bad = |problem: &str| format!("line {}: {problem}", number + 1);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => mesh
                .points
                .push(point(&mut words).ok_or_else(|| bad("a corner without three numbers"))?),
            Some("f") => {
                // A corner is `place/texture/normal`. Places count from 1, or if negative from the last one back.
                let corners = words.map(|word| {
                    let place = i64::from_str(word.split('/').next()?).ok()?;
                    let index = if place < 0 {
                        mesh.points.len() as i64 + place
                    } else {
                        place - 1
                    };
                    u32::try_from(index).ok()
                });
                let corners: Option<Vec<u32>> = corners.collect();
                mesh.fan(&corners.ok_or_else(|| bad("a face with a corner that is no number"))?);
            }
            _ => {}
        }
    }
    Ok(mesh)
}

fn point(words: &mut SplitWhitespace) -> Option<Point3<f64>> {
    let mut number = || words.next()?.parse().ok();
    Some(Point3::new(number()?, number()?, number()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron as text of STL and OBJ, and as binary STL.
    const CORNERS: [[f32; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.0, 0.0, 3.0],
    ];
    const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn volume(mesh: &Triangles) -> f64 {
        let at = |i: u32| mesh.points[i as usize].coords;
        mesh.triangles
            .iter()
            .map(|&[a, b, c]| at(a).cross(&at(b)).dot(&at(c)) / 6.0)
            .sum()
    }

    fn binary(head: &[u8]) -> Vec<u8> {
        let mut bytes = head.to_vec();
        bytes.resize(80, 0);
        bytes.extend(4_u32.to_le_bytes());
        for face in FACES {
            bytes.extend([0; 12]);
            bytes.extend(
                face.iter()
                    .flat_map(|&i| CORNERS[i])
                    .flat_map(f32::to_le_bytes),
            );
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn stl_and_obj_give_the_same_solid() {
        let mut text = "solid a b\n".to_string();
        for face in FACES {
            text += "facet normal 0 0 0\n outer loop\n";
            for [x, y, z] in face.map(|i| CORNERS[i]) {
                text += &format!("  VERTEX {x} {y} {z}e0\n");
            }
            text += " endloop\nendfacet\n";
        }
        text += "endsolid\n";
        let points = CORNERS
            .map(|[x, y, z]| format!("v {x} {y} {z} 1\n"))
            .concat();
        let faces = FACES
            .map(|[a, b, c]| format!("f {}/1/1 {}//2 -{}\n", a + 1, b + 1, 4 - c))
            .concat();
        let meshes = [
            stl(text.as_bytes()).unwrap(),
            stl(&binary(b"solid, though binary")).unwrap(),
            stl(&binary(b"")).unwrap(),
            obj(&format!("# a tetrahedron\n{points}vn 0 0 1\n{faces}")).unwrap(),
        ];
        for mesh in &meshes {
            assert!((volume(mesh) - 1.0).abs() < 1e-12, "{}", volume(mesh));
        }
    }

    #[test]
    fn faces_with_more_corners_become_triangles() {
        let square = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
        assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn bad_files_are_refused_in_words() {
        let folder = tempfile::tempdir().unwrap();
        let mut cut = binary(b"");
        cut.truncate(200);
        let nan = binary(b"")
            .iter()
            .enumerate()
            .map(|(i, b)| if i == 99 { 0x7f } else { *b })
            .collect::<Vec<_>>();
        let cases: [(&str, &[u8], &str); 11] = [
            (
                "a.stl",
                &cut,
                "it is not an STL file, or one that is cut off",
            ),
            ("a.stl", &nan, "a coordinate is not a number or too large"),
            ("a.stl", b"solid a\nendsolid a\n", "it has no triangles"),
            (
                "a.stl",
                b"solid a\nvertex 1 2\n",
                "line 2: a vertex without three numbers",
            ),
            (
                "a.stl",
                b"solid a\nvertex 1 2 3\n",
                "a triangle does not have three corners",
            ),
            (
                "a.obj",
                b"v 0 2 0\nv 0 2 0\nf 1 2 1\n",
                "all of its corners coincide",
            ),
            (
                "a.obj",
                b"v 0 0 0\nf 1 2 3\n",
                "a triangle names a corner that does not exist",
            ),
            (
                "a.obj",
                b"v 0 0 0\nf 1 2 x\n",
                "line 2: a face with a corner that is no number",
            ),
            ("a.obj", b"v \xff 0 0\n", "it is not text in UTF-8"),
            ("a.dae", b"<COLLADA>", "malformed"),
            (
                "a.step",
                b"",
                "its format is not supported; accepted: .stl, .obj, .dae",
            ),
        ];
        for (name, bytes, expected) in cases {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let problem = read(&path).unwrap_err();
            assert!(problem.contains(expected), "{expected}: {problem}");
        }
        let path = folder.path().join("b.stl");
        std::fs::write(
            &path,
            "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n",
        )
        .unwrap();
        assert!(is_lfs_pointer(&path) && !is_lfs_pointer(&folder.path().join("a.obj")));
    }
}
