//! Writes the pictures of a film: some moments one by one and as a strip (like Fig. 8, 12 and 13 of the paper), and a
//! GIF.

use super::files::{png, strip};
use super::film::{Cast, FramesOptions, moments};
use super::motion::moving;
use image::RgbImage;
use rayon::prelude::*;
use standfast_core::error::{Error, Result};
use standfast_files::{own_folder, write_atomic};
use standfast_sim::episode::Film;
use std::fs;
use std::path::{Path, PathBuf};

const STRIP: &str = "strip.png";
const GIF: &str = "motion.gif";

/// Writes `frame-0001-0.480s.png` and so on, `strip.png` and `motion.gif` to `folder`, which is created if necessary.
/// The robot of a second film of the same trial is drawn as a ghost, or beside the first if it has another controller.
/// Frames of an earlier film are removed. Returns the paths of the files. Fails like [`check_folder`], if a file cannot
/// be written, or if the film has no moment.
pub fn write_frames(
    film: &Film,
    second: Option<&Film>,
    folder: &Path,
    options: &FramesOptions,
) -> Result<Vec<PathBuf>> {
    let before = check_folder(folder)?;
    if film.snapshots.is_empty() {
        return Err(Error::Numeric {
            what: "frames".into(),
            problem: "the episode has no moment to draw".into(),
        });
    }
    let cast = Cast::new(film, second);
    let moments = moments(&cast, options.moments);
    let pictures = |size: [u32; 2]| -> Vec<RgbImage> {
        let size = cast.size_of_one(size);
        let camera = cast.camera(moments.iter().copied(), size);
        moments
            .par_iter()
            .map(|&k| cast.picture(k, &camera, size, ""))
            .collect()
    };
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    for (i, (&k, image)) in moments.iter().zip(pictures(options.size)).enumerate() {
        files.push((
            format!("frame-{:04}-{:.3}s.png", i + 1, film.snapshots[k].time_s),
            png(&image),
        ));
    }
    files.push((STRIP.into(), png(&strip(&pictures(options.strip_size)))));
    files.push((GIF.into(), moving(&cast, options)?));

    for old in before
        .iter()
        .filter(|old| !files.iter().any(|(name, _)| name == *old))
    {
        let path = folder.join(old);
        fs::remove_file(&path).map_err(|source| Error::Write { path, source })?;
    }
    let mut paths = Vec::new();
    for (name, bytes) in files {
        let path = folder.join(name);
        write_atomic(&path, &bytes)?;
        paths.push(path);
    }
    Ok(paths)
}

/// Names of the frames that are already in a folder; none if the folder does not exist. Fails if the path is a file, or
/// if the folder holds other files.
pub fn check_folder(folder: &Path) -> Result<Vec<String>> {
    let accepted = format!(
        "a folder that is new, empty, or holds nothing but frames (frame-*.png, {STRIP}, {GIF})"
    );
    own_folder("--frames", folder, is_frame, &accepted)
}

/// Whether [`write_frames`] may have written a file of this name.
fn is_frame(name: &str) -> bool {
    let numbered = name
        .strip_prefix("frame-")
        .and_then(|rest| rest.strip_suffix("s.png"));
    let parts = numbered.and_then(|numbered| {
        let (number, time) = numbered.split_once('-')?;
        let (s, ms) = time.split_once('.')?;
        Some([number, s, ms])
    });
    let is_numbered = parts.is_some_and(|parts| {
        let mut parts = parts.iter();
        parts.all(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()))
    });
    name == STRIP || name == GIF || is_numbered
}

#[cfg(test)]
mod tests {
    use super::super::motion::{LAST_DELAY_CS, shots};
    use super::*;
    use image::AnimationDecoder;
    use image::codecs::gif::GifDecoder;
    use standfast_core::robot::Foot;
    use standfast_sim::Push;
    use standfast_sim::episode::{Disturbance, EpisodeConfig, Footstep};
    use std::io::Cursor;

    /// A film of one second, with a push at 0.3 s and a footstep in the record that never happened.
    fn film() -> Film {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let config = EpisodeConfig {
            horizon_s: 1.0,
            ..EpisodeConfig::of(&standfast_core::robot::Units::of(&robot))
        };
        let factory = standfast_controllers::load("hold")
            .unwrap()
            .prepare(&robot, config.control_period_s)
            .unwrap();
        let push = Push {
            impulse_n_s: 1.0,
            heading_deg: 180.0,
            start_s: 0.3,
            ..Push::default()
        };
        let disturbance = Disturbance {
            pushes: vec![push],
            ..Disturbance::default()
        };
        let mut film = Film::take(
            &robot,
            &factory,
            &config,
            disturbance,
            (config.until(), 0.5),
            &mut |_| {},
        )
        .unwrap();
        film.record.footsteps.taken = vec![Footstep {
            foot: Foot::Left,
            lift_s: 0.4,
            land_s: 0.5,
            from_m: [0.0; 3],
            to_m: [0.0; 3],
            zmp_error_m: None,
            in_set_at_landing: None,
        }];
        (film.record.settled_at_s, film.record.fell_at_s) = (None, None);
        film
    }

    fn small() -> FramesOptions {
        let size = [48, 36];
        FramesOptions {
            size,
            strip_size: [20, 36],
            gif_size: size,
            moments: 7,
            ..FramesOptions::default()
        }
    }

    #[test]
    fn moments_tell_the_story() {
        let film = film();
        let times = |count: usize| -> Vec<f64> {
            moments(&Cast::new(&film, None), count)
                .into_iter()
                .map(|k| (film.snapshots[k].time_s * 1000.0).round() / 1000.0)
                .collect()
        };
        // The moments are: before the push, at its end, lift, mid swing, landing, and the end.
        assert_eq!(times(6), [0.276, 0.35, 0.4, 0.45, 0.5, 1.0]);
        let more = times(9);
        assert_eq!(more.len(), 9);
        assert!(
            more.is_sorted() && times(6).iter().all(|time| more.contains(time)),
            "{more:?}"
        );
        let fewer = times(3);
        assert_eq!((fewer.len(), fewer[0], fewer[2]), (3, 0.276, 1.0));
        let fallen = {
            let mut film = film.clone();
            film.record.footsteps.taken.clear();
            film.record.fell_at_s = Some(0.7);
            moments(&Cast::new(&film, None), 4)
        };
        assert_eq!(fallen, [138, 175, 350, 500]);
    }

    /// Pictures end when the robot has flown off, since they would show an empty floor.
    #[test]
    fn a_robot_that_has_flown_off_is_not_drawn() {
        let mut film = film();
        for snapshot in &mut film.snapshots[300..] {
            snapshot.com.z = 6.0;
        }
        let (last, moments) = (
            shots(&Cast::new(&film, None), 0.25)
                .last()
                .map(|shot| shot.snapshot),
            moments(&Cast::new(&film, None), 4),
        );
        assert_eq!(
            (last, moments.last()),
            (Some(299), Some(&299)),
            "{moments:?}"
        );
    }

    #[test]
    fn files_are_written_and_the_gif_lasts_as_long_as_it_should() {
        let (film, options) = (film(), small());
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("new/frames");
        let files = write_frames(&film, None, &folder, &options).unwrap();
        let names: Vec<_> = files
            .iter()
            .map(|file| file.file_name().unwrap().to_str().unwrap())
            .collect();
        assert_eq!(
            (names.len(), names[0], names[1]),
            (9, "frame-0001-0.276s.png", "frame-0002-0.350s.png")
        );
        assert_eq!(names[7..], [STRIP, GIF]);
        assert!(names.iter().all(|name| is_frame(name)));
        let still = image::open(&files[0]).unwrap();
        assert_eq!((still.width(), still.height()), (48, 36));
        assert_eq!(image::open(folder.join(STRIP)).unwrap().width(), 7 * 20);

        let bytes = fs::read(folder.join(GIF)).unwrap();
        let frames = GifDecoder::new(Cursor::new(&bytes))
            .unwrap()
            .into_frames()
            .collect_frames()
            .unwrap();
        assert_eq!(
            frames.len(),
            shots(&Cast::new(&film, None), options.slow_motion).len()
        );
        let shown_ms: u32 = frames
            .iter()
            .map(|frame| frame.delay().numer_denom_ms().0)
            .sum();
        // The GIF begins at 0.1 s with 0.16 s in real time, is slow from 0.26 s until 0.1 s after the landing, and then
        // runs in real time again.
        let expected_s = 0.16 + 4.0 * 0.34 + 0.4 + f64::from(LAST_DELAY_CS) / 100.0;
        assert!(
            (f64::from(shown_ms) / 1000.0 - expected_s).abs() < 0.05,
            "{shown_ms} ms"
        );

        // A film with a robot that sways for ten more seconds.
        let mut long = film.clone();
        long.snapshots
            .extend((0..10).flat_map(|_| film.snapshots.iter().cloned()));
        for (k, snapshot) in long.snapshots.iter_mut().enumerate() {
            snapshot.time_s = k as f64 * film.control_period_s;
        }
        let shots = shots(&Cast::new(&long, None), options.slow_motion);
        let last = shots.len() - 1;
        assert!(
            (150..=205).contains(&shots.len()),
            "{} pictures",
            shots.len()
        );
        assert_eq!(
            (shots[0].speed, shots[30].speed, shots[last - 1].speed),
            (1.0, 0.25, 2.0)
        );
        assert_eq!(shots[last].snapshot, long.snapshots.len() - 1);

        // If the pictures are written again with fewer moments, the old frames are removed.
        let files = write_frames(
            &film,
            None,
            &folder,
            &FramesOptions {
                moments: 4,
                ..options
            },
        )
        .unwrap();
        assert_eq!(
            (files.len(), fs::read_dir(&folder).unwrap().count()),
            (6, 6)
        );
    }

    /// Nothing is written before the folder is checked.
    #[test]
    fn a_folder_with_a_foreign_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        for own in ["frame-0001-0.123s.png", STRIP] {
            fs::write(folder.path().join(own), own).unwrap();
        }
        check_folder(folder.path()).unwrap();
        for foreign in [
            "frame-1.png",
            "frame-0001-0.5s.png.txt",
            "frame--1.5s.png",
            "notes.txt",
        ] {
            fs::write(folder.path().join(foreign), foreign).unwrap();
            let refused = check_folder(folder.path()).unwrap_err().to_string();
            assert!(
                refused.contains(foreign) && refused.contains("accepted: a folder that is new"),
                "{refused}"
            );
            fs::remove_file(folder.path().join(foreign)).unwrap();
        }
        assert!(
            check_folder(&folder.path().join(STRIP))
                .unwrap_err()
                .to_string()
                .contains("it is a file")
        );
    }
}
