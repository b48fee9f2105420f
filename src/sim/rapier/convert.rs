//! Conversions between Rapier's f32 glam types and the f64 nalgebra types of the rest of the program.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::prelude::{Pose, Rotation, Vector};

pub fn vec_to_rapier(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

pub fn rotation_to_rapier(r: &UnitQuaternion<f64>) -> Rotation {
    Rotation::from_xyzw(r.i as f32, r.j as f32, r.k as f32, r.w as f32).normalize()
}

pub fn pose_to_rapier(p: &Isometry3<f64>) -> Pose {
    Pose::from_parts(
        vec_to_rapier(&p.translation.vector),
        rotation_to_rapier(&p.rotation),
    )
}

pub fn vec_from_rapier(v: Vector) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

pub fn pose_from_rapier(p: &Pose) -> Isometry3<f64> {
    let r = p.rotation;
    let q = Quaternion::new(
        f64::from(r.w),
        f64::from(r.x),
        f64::from(r.y),
        f64::from(r.z),
    );
    Isometry3::from_parts(
        Translation3::from(vec_from_rapier(p.translation)),
        UnitQuaternion::from_quaternion(q),
    )
}
