//! Opening the window, or saying in one line why there is none.
//!
//! kiss3d panics where it cannot open a window. So what can be known before is looked at before, and the panic of the
//! rest is caught and told as an error.

use crate::error::{Error, Result};
use kiss3d::camera::Camera3d;
use kiss3d::scene::SceneNode3d;
use kiss3d::window::{CanvasSetup, NumSamples, Window};
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
#[cfg(all(unix, not(target_os = "macos")))]
use std::path::Path;

/// What to do where there is no window.
const NO_DISPLAY: &str = "start it from a desktop session, or under Xvfb (apt-get install xvfb; xvfb-run standfast view ...); \
                          without a display: `standfast push --replay push.html`, or `standfast replay` of a result";
const NO_DRIVER: &str = "install a Vulkan driver (apt-get install mesa-vulkan-drivers libvulkan1); without one: \
                         `standfast push --replay push.html`, or `standfast replay` of a result";
const NO_LIBRARY: &str =
    "install the libraries that windows under X need (apt-get install libxkbcommon-x11-0 libxcursor1 libxi6)";

/// Opens the window, size in pixels. Errors: no display that answers, no graphics driver, or a library is missing.
pub fn open(title: &str, width: u32, height: u32) -> Result<Window> {
    // Held until the window has its own: an X server begins anew when its last connection ends, and refuses others
    // then.
    let _held = display().map_err(|missing| no_window(missing, NO_DISPLAY))?;
    let setup = CanvasSetup { vsync: true, samples: NumSamples::Four, ..CanvasSetup::default() };
    quietly(|| pollster::block_on(Window::new_with_setup(title, width, height, setup))).map_err(|told| {
        let is_about = |words: &[&str]| words.iter().any(|word| told.contains(word));
        if is_about(&["Library", "library", ".so"]) {
            no_window(format!("a library for the window is missing ({told})"), NO_LIBRARY)
        } else if is_about(&["adapter", "device", "urface"]) {
            no_window(format!("no graphics driver for the window ({told})"), NO_DRIVER)
        } else {
            no_window(format!("the window cannot be opened ({told})"), NO_DISPLAY)
        }
    })
}

/// Draws a frame and takes in what the person does; false if the window is to be closed. Errors: there is no window any
/// more ([`Error::LostWindow`]).
pub fn render(window: &mut Window, root: &mut SceneNode3d, camera: &mut impl Camera3d) -> Result<bool> {
    quietly(|| pollster::block_on(window.render_3d(root, camera))).map_err(lost)
}

/// The window is gone.
pub fn lost(cause: String) -> Error {
    Error::LostWindow { cause }
}

/// A connection.
type Held = Box<dyn std::any::Any>;

/// A connection to the display that the environment names, Wayland before X, as winit takes them. None where it was
/// handed over as a connection already, and where there is no such environment; else what is missing, in words.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn display() -> std::result::Result<Option<Held>, String> {
    let set = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    if set("WAYLAND_SOCKET").is_some() {
        return Ok(None);
    }
    if let Some(name) = set("WAYLAND_DISPLAY") {
        // A name with a slash at its start is a path of its own.
        let path = Path::new(&set("XDG_RUNTIME_DIR").unwrap_or_default()).join(&name);
        let connection = std::os::unix::net::UnixStream::connect(path);
        let connection = connection.map_err(|e| format!("no display: Wayland's {name} does not answer ({e})"))?;
        return Ok(Some(Box::new(connection)));
    }
    let name = set("DISPLAY").ok_or("no display: neither DISPLAY nor WAYLAND_DISPLAY is set")?;
    let (connection, _) =
        x11rb::connect(Some(&name)).map_err(|e| format!("no display: DISPLAY={name} does not answer ({e})"))?;
    Ok(Some(Box::new(connection)))
}

#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn display() -> std::result::Result<Option<Held>, String> {
    Ok(None)
}

/// Runs what tells by panics and many lines what can be told in one: in short why it panicked.
fn quietly<T>(run: impl FnOnce() -> T) -> std::result::Result<T, String> {
    let level = log::max_level();
    // Who wants to read the lines of the graphics stack says so.
    let is_asked = std::env::var_os("RUST_LOG").is_some();
    let hook = take_hook();
    if !is_asked {
        log::set_max_level(log::LevelFilter::Off);
        set_hook(Box::new(|_| {}));
    }
    let done = catch_unwind(AssertUnwindSafe(run));
    set_hook(hook);
    log::set_max_level(level);
    done.map_err(|panic| {
        let told = panic.downcast_ref::<String>().map(String::as_str);
        let told = told.or(panic.downcast_ref::<&str>().copied()).unwrap_or("unknown cause");
        // The rest is for whoever debugs the graphics stack.
        told.split([':', '\n']).next().unwrap_or_default().into()
    })
}

fn no_window(missing: String, remedy: &str) -> Error {
    Error::NoWindow { missing, remedy: remedy.into() }
}
