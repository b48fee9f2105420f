//! Opens the window, or says on one line why there is none.
//!
//! kiss3d panics if it cannot open a window. Therefore the display is checked first, and any other panic is caught and
//! returned as an error.

use kiss3d::camera::Camera3d;
use kiss3d::scene::SceneNode3d;
use kiss3d::window::{CanvasSetup, NumSamples, Window};
use standfast_core::error::{Error, Result};
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
#[cfg(all(unix, not(target_os = "macos")))]
use std::path::Path;

/// Remedies for a missing display, a missing graphics driver, and a missing library.
const NO_DISPLAY: &str = "start it from a desktop session, or under Xvfb (apt-get install xvfb; xvfb-run standfast view ...); \
                          without a display: `standfast push --replay push.html`, or `standfast replay` of a result";
const NO_DRIVER: &str = "install a Vulkan driver (apt-get install mesa-vulkan-drivers libvulkan1); without one: \
                         `standfast push --replay push.html`, or `standfast replay` of a result";
const NO_LIBRARY: &str = "install the libraries that windows under X need (apt-get install libxkbcommon-x11-0 libxcursor1 libxi6)";

/// Opens a window of a size (pixels). Fails if no display answers, or if a graphics driver or a library is missing.
pub fn open(title: &str, width: u32, height: u32) -> Result<Window> {
    // This connection is kept until the window has its own, since an X server restarts when its last connection ends,
    // and refuses connections during the restart.
    let _held = display().map_err(|missing| no_window(missing, NO_DISPLAY))?;
    let setup = CanvasSetup {
        vsync: true,
        samples: NumSamples::Four,
        ..CanvasSetup::default()
    };
    quietly(|| pollster::block_on(Window::new_with_setup(title, width, height, setup))).map_err(
        |problem| {
            let is_about = |words: &[&str]| words.iter().any(|word| problem.contains(word));
            if is_about(&["Library", "library", ".so"]) {
                no_window(
                    format!("a library for the window is missing ({problem})"),
                    NO_LIBRARY,
                )
            } else if is_about(&["adapter", "device", "urface"]) {
                no_window(
                    format!("no graphics driver for the window ({problem})"),
                    NO_DRIVER,
                )
            } else {
                no_window(
                    format!("the window cannot be opened ({problem})"),
                    NO_DISPLAY,
                )
            }
        },
    )
}

/// Draws a frame and collects the input. Returns false if the window is to be closed. Fails if the window is lost
/// ([`Error::LostWindow`]).
pub fn render(
    window: &mut Window,
    root: &mut SceneNode3d,
    camera: &mut impl Camera3d,
) -> Result<bool> {
    quietly(|| pollster::block_on(window.render_3d(root, camera))).map_err(lost)
}

pub fn lost(cause: String) -> Error {
    Error::LostWindow { cause }
}

/// An open connection.
type Held = Box<dyn std::any::Any>;

/// Opens a connection to the display that the environment names, Wayland before X, like winit. It is None if the
/// environment hands over an open connection, and on systems without these variables. The error says what is missing.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn display() -> std::result::Result<Option<Held>, String> {
    let set = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    if set("WAYLAND_SOCKET").is_some() {
        return Ok(None);
    }
    if let Some(name) = set("WAYLAND_DISPLAY") {
        // A name that begins with a slash is a whole path.
        let path = Path::new(&set("XDG_RUNTIME_DIR").unwrap_or_default()).join(&name);
        let connection = std::os::unix::net::UnixStream::connect(path);
        let connection = connection
            .map_err(|e| format!("no display: Wayland's {name} does not answer ({e})"))?;
        return Ok(Some(Box::new(connection)));
    }
    let name = set("DISPLAY").ok_or("no display: neither DISPLAY nor WAYLAND_DISPLAY is set")?;
    let (connection, _) = x11rb::connect(Some(&name))
        .map_err(|e| format!("no display: DISPLAY={name} does not answer ({e})"))?;
    Ok(Some(Box::new(connection)))
}

#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn display() -> std::result::Result<Option<Held>, String> {
    Ok(None)
}

/// Runs code that reports errors by panics and many log lines. The error is the first part of the panic's message.
fn quietly<T>(run: impl FnOnce() -> T) -> std::result::Result<T, String> {
    let level = log::max_level();
    // A user who sets RUST_LOG wants to read the lines of the graphics stack.
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
        let message = panic.downcast_ref::<String>().map(String::as_str);
        let message = message
            .or(panic.downcast_ref::<&str>().copied())
            .unwrap_or("unknown cause");
        // The rest of the message only helps to debug the graphics stack.
        message.split([':', '\n']).next().unwrap_or_default().into()
    })
}

fn no_window(missing: String, remedy: &str) -> Error {
    Error::NoWindow {
        missing,
        remedy: remedy.into(),
    }
}
