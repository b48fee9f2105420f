//! Triangles in a picture, the cells that are inside of them, and their light.

/// Linear light, red, green and blue.
pub(super) type Light = [f32; 3];

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

/// The code value of linear light. Gamma is 2 instead of the screen's 2.2, since a square root is exact on every
/// machine.
pub(super) fn stored(light: f32) -> u8 {
    (255.0 * light.clamp(0.0, 1.0).sqrt() + 0.5) as u8
}

/// The linear light of a colour (code values from 0 to 1).
pub(super) const fn linear([r, g, b]: [f64; 3]) -> Light {
    [(r * r) as f32, (g * g) as f32, (b * b) as f32]
}

/// Calls `call` for each cell whose middle is inside of a triangle and of the window (left, top, right, bottom; the
/// last two not included), with the weights of the three corners there.
pub(super) fn for_each_inside(
    [a, b, c]: [[f64; 2]; 3],
    window: [usize; 4],
    mut call: impl FnMut(usize, usize, [f64; 3]),
) {
    /// Share by which a middle may be outside, so that no cell is missed between two triangles.
    const SLACK: f64 = -1e-9;
    let area = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2], [cx, cy]: [f64; 2]| {
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    };
    let all = area(a, b, c);
    if all == 0.0 || !all.is_finite() {
        return;
    }
    // Numbers below zero become zero here.
    let from = [0, 1].map(|i| (a[i].min(b[i]).min(c[i]).floor() as usize).max(window[i]));
    let to = [0, 1].map(|i| (a[i].max(b[i]).max(c[i]).ceil() as usize).min(window[i + 2]));
    for y in from[1]..to[1] {
        for x in from[0]..to[0] {
            let at = [x as f64 + 0.5, y as f64 + 0.5];
            let weights = [area(b, c, at), area(c, a, at), area(a, b, at)].map(|part| part / all);
            if weights.iter().all(|weight| *weight >= SLACK) {
                call(x, y, weights);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of triangles about a point in a rectangle, in both orientations.
    #[test]
    fn triangles_that_share_edges_leave_no_gap_and_reach_no_farther() {
        let rim = [
            [2.0, 3.0],
            [20.5, 3.0],
            [33.3, 3.0],
            [33.3, 28.3],
            [11.25, 28.3],
            [2.0, 9.1],
        ];
        let mut times = [[0; 40]; 32];
        for (i, &a) in rim.iter().enumerate() {
            let (b, center) = (rim[(i + 1) % rim.len()], [20.123, 9.871]);
            let corners = if i % 2 == 0 {
                [a, b, center]
            } else {
                [a, center, b]
            };
            for_each_inside(corners, [0, 0, 40, 32], |x, y, weights| {
                times[y][x] += 1;
                let at: f64 = weights
                    .iter()
                    .zip(corners)
                    .map(|(w, corner)| w * corner[0])
                    .sum();
                assert!((at - x as f64 - 0.5).abs() < 1e-6, "{at} {x}");
            });
        }
        for (x, y) in (0..40).flat_map(|x| (0..32).map(move |y| (x, y))) {
            let is_inside = (2..33).contains(&x) && (3..28).contains(&y) && {
                // Above the line from (2, 9.1) to (11.25, 28.3).
                (x as f64 - 1.5) * 19.2 > (y as f64 - 8.6) * 9.25
            };
            assert_eq!(times[y][x] > 0, is_inside, "{x} {y}");
        }
    }

    #[test]
    fn a_colour_comes_back_as_it_was() {
        assert!((0..=255).all(|byte| stored(linear([f64::from(byte) / 255.0; 3])[0]) == byte));
    }
}
