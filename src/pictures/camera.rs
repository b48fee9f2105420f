//! A pinhole camera that looks at a point, with the world's z axis up in the picture.

use nalgebra::{Point3, Vector3};

/// The place from which a picture is taken, in perspective.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Point in the middle of the picture (m, world frame).
    pub target: Point3<f64>,
    /// Direction from the target to the camera (degrees): 0 is +x, in front of the robot, and 90 is +y, at its left.
    pub azimuth_deg: f64,
    /// Angle of the camera above the horizontal (degrees), from -89 to 89.
    pub elevation_deg: f64,
    /// Distance from the target (m), positive.
    pub distance_m: f64,
    /// Angle between the lower and the upper edge of the picture (degrees), below 180.
    pub fov_deg: f64,
}

impl Camera {
    /// Where a point (m, world frame) is seen in a picture of `size` (px), to the right and down from the upper left
    /// corner. None if it is not in front of the camera.
    pub fn project(&self, point: Point3<f64>, size: [u32; 2]) -> Option<[f64; 2]> {
        CameraView::new(self, size)
            .project(point)
            .map(|[x, y, _]| [x, y])
    }

    /// The view from the nearest place, in the same direction, that shows the balls (centre and radius, m) whole in a
    /// picture of `size` (px), with `margin` (a share of the half width and height) around them. Without balls, the
    /// camera is unchanged.
    pub fn framing(&self, balls: &[(Point3<f64>, f64)], size: [u32; 2], margin: f64) -> Self {
        let view = CameraView::new(self, size);
        let free = 1.0 - margin;
        let slope = view.middle.map(|half| free * half / view.focal_px);
        // A ball touches a plane through the eye if its centre is this multiple of its radius inside of it.
        let reach = slope.map(|slope| (1.0 + slope * slope).sqrt());
        // The largest value over the balls of (across + slope * towards the camera), for each plane of the view
        // pyramid.
        let most = |axis: Vector3<f64>, i: usize| {
            let extents = balls.iter().map(|(at, radius)| {
                axis.dot(&at.coords) + slope[i] * view.back.dot(&at.coords) + radius * reach[i]
            });
            extents.fold(f64::NEG_INFINITY, f64::max)
        };
        let [right, left] = [view.right, -view.right].map(|axis| most(axis, 0));
        let [up, down] = [view.up, -view.up].map(|axis| most(axis, 1));
        if !(right + left + up + down).is_finite() {
            return *self;
        }
        let back = ((right + left) / (2.0 * slope[0])).max((up + down) / (2.0 * slope[1]));
        let eye =
            view.right * ((right - left) / 2.0) + view.up * ((up - down) / 2.0) + view.back * back;
        // The target is at the depth of the middle of the balls, so that the distance is the distance from the robot.
        let depths = balls.iter().map(|(at, _)| view.back.dot(&at.coords));
        let (near, far) = depths.fold((f64::NEG_INFINITY, f64::INFINITY), |(n, f), d| {
            (n.max(d), f.min(d))
        });
        let distance_m = back - (near + far) / 2.0;
        Self {
            target: Point3::from(eye - view.back * distance_m),
            distance_m,
            ..*self
        }
    }
}

/// A camera prepared for pictures of one size (world frame).
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraView {
    pub eye: Point3<f64>,
    pub right: Vector3<f64>,
    pub up: Vector3<f64>,
    /// Direction from the target to the eye.
    pub back: Vector3<f64>,
    /// Pixels per unit of slope.
    pub focal_px: f64,
    /// Middle of the picture (px).
    pub middle: [f64; 2],
    pub distance_m: f64,
    pub target: Point3<f64>,
}

/// Least distance from the eye of points that are drawn (m).
pub(super) const NEAREST_M: f64 = 0.02;

impl CameraView {
    pub fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let (sin_a, cos_a) = camera.azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = camera.elevation_deg.to_radians().sin_cos();
        let (sin_f, cos_f) = (camera.fov_deg / 2.0).to_radians().sin_cos();
        let back = Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        let right = Vector3::new(-sin_a, cos_a, 0.0);
        let middle = size.map(|px| f64::from(px) / 2.0);
        Self {
            eye: camera.target + back * camera.distance_m,
            right,
            up: back.cross(&right),
            back,
            focal_px: middle[1] * cos_f / sin_f,
            middle,
            distance_m: camera.distance_m,
            target: camera.target,
        }
    }

    /// Place of a point in the picture (px, to the right and down), and one over its depth (1/m), which is linear over
    /// the picture of a plane. None if it is not in front of the camera.
    pub fn project(&self, point: Point3<f64>) -> Option<[f64; 3]> {
        let from_eye = point - self.eye;
        let depth = -self.back.dot(&from_eye);
        if depth.is_nan() || depth <= NEAREST_M {
            return None;
        }
        let scale = self.focal_px / depth;
        let [x, y] = self.middle;
        Some([
            x + scale * self.right.dot(&from_eye),
            y - scale * self.up.dot(&from_eye),
            1.0 / depth,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera {
        target: Point3::new(0.1, -0.2, 0.3),
        azimuth_deg: 30.0,
        elevation_deg: 20.0,
        distance_m: 2.0,
        fov_deg: 40.0,
    };

    /// The formula is x = f X / Z with f = (h / 2) / tan(fov / 2). The camera is at +x and looks along -x, so +y is
    /// right.
    #[test]
    fn a_point_is_seen_where_the_pinhole_formula_says() {
        let camera = Camera {
            target: Point3::origin(),
            azimuth_deg: 0.0,
            elevation_deg: 0.0,
            ..CAMERA
        };
        let f = 240.0 / 20.0_f64.to_radians().tan();
        let [x, y] = camera
            .project(Point3::new(0.5, 0.3, 0.2), [640, 480])
            .unwrap();
        assert!(
            (x - (320.0 + f * 0.3 / 1.5)).abs() < 1e-9
                && (y - (240.0 - f * 0.2 / 1.5)).abs() < 1e-9,
            "{x} {y}"
        );
        let seen_from_left = Camera {
            azimuth_deg: 90.0,
            ..camera
        };
        let [x, _] = seen_from_left
            .project(Point3::new(0.3, 0.0, 0.0), [640, 480])
            .unwrap();
        assert!(
            (x - (320.0 - f * 0.3 / 2.0)).abs() < 1e-9,
            "from the left, forward is to the left: {x}"
        );
        assert_eq!(
            camera.project(Point3::new(2.5, 0.0, 0.0), [640, 480]),
            None,
            "behind the camera"
        );
        let [x, y] = CAMERA.project(CAMERA.target, [640, 480]).unwrap();
        assert!(
            (x - 320.0).abs() < 1e-9 && (y - 240.0).abs() < 1e-9,
            "the target is in the middle: {x} {y}"
        );
    }

    /// Some ball touches the inner frame, and no ball leaves it.
    #[test]
    fn a_framed_picture_shows_all_and_is_as_near_as_can_be() {
        let balls = [
            (Point3::new(0.0, 0.0, 0.1), 0.1),
            (Point3::new(0.5, 0.2, 0.5), 0.05),
        ];
        for size in [[640, 480], [200, 500]] {
            let view = CameraView::new(&CAMERA.framing(&balls, size, 0.1), size);
            // Distance of each ball from the planes of the inner pyramid.
            let mut least = f64::INFINITY;
            for (at, radius) in balls {
                for (axis, i) in [
                    (view.right, 0),
                    (-view.right, 0),
                    (view.up, 1),
                    (-view.up, 1),
                ] {
                    let slope = 0.9 * view.middle[i] / view.focal_px;
                    let normal = -(axis + view.back * slope) / (1.0 + slope * slope).sqrt();
                    least = least.min(normal.dot(&(at - view.eye)) - radius);
                }
            }
            assert!(least.abs() < 1e-9, "{least}");
        }
        assert_eq!(CAMERA.framing(&[], [640, 480], 0.1), CAMERA);
    }
}
