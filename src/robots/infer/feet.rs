//! Feet that stand on their stated soles. Bounds, controllers and contacts then have the same sole.

use super::soles;
use nalgebra::{Translation3, Vector3};
use standfast_core::robot::{Foot, Robot, Shape, Solid};

/// Largest difference of a stated sole from the lowest face of its foot, as a share of the longer side, up to which the foot
/// stands on its own shapes.
const SAME_FACE: f64 = 0.02;
/// Least thickness of a sole's box, as a share of the sole's shorter side.
const PLATE: f64 = 0.1;

/// Lets a foot stand on its sole: if the lowest face of its shapes at home is another one, they are replaced by a box as large
/// as the sole and as high as the foot, with a note.
pub fn stand_on_sole(robot: &mut Robot, foot: Foot) {
    let sole = robot.soles[foot];
    let [length, width] = sole.half_m.map(|half| 2.0 * half);
    let collides = !robot.links[sole.link].collisions.is_empty();
    let own = match collides {
        true => soles::find(robot, sole.link, &robot.home_rad, &Vector3::x()).ok(),
        false => None,
    };
    let of_shapes = own.map(|own| {
        // The corners of the lowest face along the axes of the stated one.
        let corners = own
            .sole
            .corners()
            .map(|corner| sole.center.inverse() * own.sole.center * corner);
        [0, 1].map(|axis| {
            let along = corners.map(|corner| corner[axis]);
            let of = |pick: fn(f64, f64) -> f64, from: f64| along.into_iter().fold(from, pick);
            [of(f64::min, f64::INFINITY), of(f64::max, f64::NEG_INFINITY)]
        })
    });
    let allowed = SAME_FACE * length.max(width);
    let is_same = |[x, y]: &[[f64; 2]; 2]| {
        let near = |[least, most]: [f64; 2], half: f64| {
            (least + half).abs() <= allowed && (most - half).abs() <= allowed
        };
        near(*x, sole.half_m[0]) && near(*y, sole.half_m[1])
    };
    let mm = |x: f64| 1e3 * x;
    let found = match &of_shapes {
        Some(sides) if is_same(sides) => return,
        Some([[x0, x1], [y0, y1]]) => format!("{:.1} x {:.1} mm", mm(x1 - x0), mm(y1 - y0)),
        None => "no flat face".into(),
    };
    let name = &robot.frames[sole.frame].name;
    let thickness = sole.thickness_m.max(PLATE * length.min(width));
    robot.notes.push(match collides {
        true => format!(
            "foot {name} collides as a box of {:.1} x {:.1} x {:.1} mm, since its sole is stated so; the lowest face of its \
             shapes has {found}",
            mm(length),
            mm(width),
            mm(thickness)
        ),
        false => format!(
            "link {name:?} has no shape with which it collides: it stands on a plate as large as its sole"
        ),
    });
    let up = Translation3::new(0.0, 0.0, 0.5 * thickness);
    robot.links[sole.link].collisions = vec![Solid {
        frame: sole.frame,
        pose: sole.center * up,
        shape: Shape::Box {
            half: Vector3::new(length, width, thickness) * 0.5,
        },
        color: [0.5, 0.5, 0.5, 1.0],
    }];
}
