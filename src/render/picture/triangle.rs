//! Triangles in a picture, and the samples that are inside of them. This is decided in integers, so that no sample
//! between two triangles is missed or painted twice.

/// Linear light, red, green and blue.
pub(super) type Light = [f32; 3];

/// Corners are rounded to a grid with this many places for each sample.
const PLACES: f64 = 256.0;
/// Corners farther out than this (samples) would overflow the integers.
const FARTHEST: f64 = 1e6;

#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    /// Pixels to the right and down.
    pub at: [f64; 2],
    /// One over the depth (1/m).
    pub near: f64,
    pub light: Light,
}

/// A triangle in the picture, in either orientation. Later triangles are painted over earlier ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    pub corners: [Vertex; 3],
    /// Opacity, from 0 to 1.
    pub cover: f32,
    /// Whether it hides later triangles that are behind it.
    pub hides: bool,
}

/// The code value of linear light. Gamma is 2 in place of the screen's 2.2, since a square root is exact on every
/// machine.
pub(super) fn stored(light: f32) -> u8 {
    (255.0 * light.clamp(0.0, 1.0).sqrt() + 0.5) as u8
}

/// The linear light of a colour (code values from 0 to 1).
pub(super) const fn linear([r, g, b]: [f64; 3]) -> Light {
    [(r * r) as f32, (g * g) as f32, (b * b) as f32]
}

/// The samples that are inside of a triangle. A sample on an edge that two triangles share belongs to one of them.
pub(super) struct Coverage {
    /// Corners on the grid, in the order that has the inside to the left.
    corners: [[i64; 2]; 3],
    /// Whether corners 1 and 2 were exchanged for that.
    turned: bool,
    /// Twice the area on the grid.
    double: i64,
    /// Bounds of the samples that may be inside, to the right and down; `to` is not included.
    from: [i64; 2],
    to: [i64; 2],
}

impl Coverage {
    /// The samples inside of a triangle, where `scale` is the number of samples for each unit of `corners`. None if it
    /// has no area, or is far outside of any picture.
    pub fn new(corners: &[[f64; 2]; 3], scale: f64) -> Option<Self> {
        // This comparison also refuses NaN.
        if !corners.iter().flatten().all(|v| (v * scale).abs() < FARTHEST) {
            return None;
        }
        let mut corners = corners.map(|at| at.map(|v| (v * scale * PLACES).round() as i64));
        let double = edge(corners[0], corners[1], corners[2]);
        if double < 0 {
            corners.swap(1, 2);
        }
        // The first sample whose middle is not before a place.
        let sample = |place: i64| (place + PLACES as i64 / 2 - 1).div_euclid(PLACES as i64);
        let [a, b, c] = corners;
        let from = [0, 1].map(|i| sample(a[i].min(b[i]).min(c[i])));
        let to = [0, 1].map(|i| sample(a[i].max(b[i]).max(c[i])) + 1);
        (double != 0).then_some(Self { corners, turned: double < 0, double: double.abs(), from, to })
    }

    /// Calls `call` for each sample that is inside of the triangle and of the window (left, top, right, bottom; the
    /// last two not included), with the weights of the three corners there.
    pub fn for_each(&self, [left, top, right, bottom]: [i64; 4], mut call: impl FnMut(i64, i64, [f64; 3])) {
        let ([x0, y0], [x1, y1]) = (self.from, self.to);
        let (x0, x1, y0, y1) = (x0.max(left), x1.min(right), y0.max(top), y1.min(bottom));
        if x0 >= x1 || y0 >= y1 {
            return;
        }
        let places = PLACES as i64;
        let [a, b, c] = self.corners;
        let edges = [(b, c), (c, a), (a, b)];
        // A sample on an edge belongs to the triangle for which it is a left or a top edge.
        let owned = edges.map(|(p, q)| i64::from(q[1] < p[1] || (q[1] == p[1] && q[0] > p[0])));
        let along = edges.map(|(p, q)| (p[1] - q[1]) * places);
        let scale = 1.0 / self.double as f64;
        for y in y0..y1 {
            let at = |x: i64| [x * places + places / 2, y * places + places / 2];
            let [mut wa, mut wb, mut wc] = edges.map(|(p, q)| edge(p, q, at(x0)));
            let mut was_inside = false;
            for x in x0..x1 {
                if wa + owned[0] > 0 && wb + owned[1] > 0 && wc + owned[2] > 0 {
                    was_inside = true;
                    let [a, b, c] = [wa as f64 * scale, wb as f64 * scale, wc as f64 * scale];
                    call(x, y, if self.turned { [a, c, b] } else { [a, b, c] });
                } else if was_inside {
                    break;
                }
                (wa, wb, wc) = (wa + along[0], wb + along[1], wc + along[2]);
            }
        }
    }
}

/// Twice the area of a triangle, positive if it turns clockwise as seen with y down.
fn edge(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of triangles about a point in a rectangle, in both orientations, with corners on and off the samples.
    #[test]
    fn each_sample_belongs_to_one_of_the_triangles_that_share_an_edge() {
        let rim =
            [[2.0, 3.0], [20.5, 3.0], [33.3, 3.0], [33.3, 17.5], [33.3, 28.5], [11.25, 28.5], [2.0, 28.5], [2.0, 9.1]];
        for center in [[15.5, 12.5], [3.25, 27.0], [20.123, 9.871]] {
            let mut times = [[0; 40]; 32];
            for (i, &a) in rim.iter().enumerate() {
                let b = rim[(i + 1) % rim.len()];
                let corners = if i % 2 == 0 { [a, b, center] } else { [a, center, b] };
                Coverage::new(&corners, 1.0).unwrap().for_each([0, 0, 40, 32], |x, y, weights| {
                    times[y as usize][x as usize] += 1;
                    // The weights are those of the sample's middle.
                    for (axis, middle) in [x as f64 + 0.5, y as f64 + 0.5].into_iter().enumerate() {
                        let at: f64 = weights.iter().zip(corners).map(|(w, corner)| w * corner[axis]).sum();
                        assert!((at - middle).abs() < 0.01, "{at} {middle}");
                    }
                });
            }
            for (y, row) in times.iter().enumerate() {
                for (x, &times) in row.iter().enumerate() {
                    // Middles from 2.5 to 32.5 and from 3.5 to 27.5 are inside. One at 28.5 is on the lower edge, and
                    // is not.
                    let inside = (2..33).contains(&x) && (3..28).contains(&y);
                    assert_eq!(times, u32::from(inside), "{x} {y}, center {center:?}");
                }
            }
        }
    }

    #[test]
    fn triangles_without_area_or_out_of_reach_are_left_out() {
        assert!(Coverage::new(&[[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]], 1.0).is_none());
        assert!(Coverage::new(&[[1.0, 1.0], [2e6, 2.0], [3.0, 5.0]], 1.0).is_none());
        assert!(Coverage::new(&[[1.0, 1.0], [f64::NAN, 2.0], [3.0, 5.0]], 1.0).is_none());
    }

    #[test]
    fn a_colour_comes_back_as_it_was() {
        for byte in 0..=255 {
            assert_eq!(stored(linear([f64::from(byte) / 255.0; 3])[0]), byte);
        }
    }
}
