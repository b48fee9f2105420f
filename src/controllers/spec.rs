//! The interface of every kind of controllers: settings that are read from a file, and make a [`PreparedController`] for a robot.

use super::tunable::Tunable;
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use std::any::Any;
use std::fmt::{self, Debug};
use toml::Table;

/// The settings of a controller, read and checked, for any robot.
pub trait ControllerSpec: Any + Debug + Send + Sync {
    /// Name of the controller in tables and results.
    fn name(&self) -> &str;

    /// Checks the values. Errors name `file`, the field, its value and the accepted values.
    fn check(&self, file: &str) -> Result<()>;

    /// The file with all defaults filled in, in which a [variant](super::variant) changes a value.
    fn tree(&self) -> Table;

    /// The text of a file that states these settings. Its numbers are those of the tree.
    fn text(&self) -> String {
        let mut tree = self.tree();
        // The key `file` is the path from which the controller was read, and no file states it.
        tree.remove("file");
        toml::to_string(&tree).expect("it was read from a table")
    }

    /// Names of the totals in the controller's reports, which become columns of a result.
    fn totals(&self) -> &'static [&'static str] {
        &[]
    }

    /// The files that the controller needs beside its own file, each by its path relative to that file. They are inputs
    /// of a result.
    fn files(&self) -> Result<Vec<(String, Vec<u8>)>> {
        Ok(Vec::new())
    }

    /// Whether the controller starts a command that its file names.
    fn is_program(&self) -> bool {
        false
    }

    /// Paths to elsewhere and programs on which the controller depends and which are not among its files, in words of
    /// its file.
    fn not_kept(&self) -> Vec<String> {
        Vec::new()
    }

    /// How the robot's motors differ from those with which the controller was trained, in words; None if they do not, or if
    /// nothing is known of them.
    fn trained_otherwise(&self, _robot: &Robot) -> Option<String> {
        None
    }

    /// Number of episodes that have to be open at once for a controller that answers to many of them together; 0 for
    /// one that answers to each alone.
    fn open_episodes(&self) -> usize {
        0
    }

    /// The numbers that are worth tuning, each with a range that is worth searching.
    fn tunables(&self) -> Vec<Tunable> {
        Vec::new()
    }

    /// Prepares the controller for a robot and a control period (s). Fails if the settings do not suit the robot.
    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController>;
}

/// Checks the name that a file states.
pub fn check_name(file: &str, name: &str) -> Result<()> {
    let stated = format!("{name:?}");
    if name.trim().is_empty() {
        Err(Error::value(file, "name", stated, "is empty", "a name"))
    } else {
        Ok(())
    }
}

/// The description that a file states. If it states none, it is the controller's maker.
pub fn about(description: &str, made_by: &str) -> String {
    if description.is_empty() {
        format!("by {made_by}")
    } else {
        description.into()
    }
}

/// A controller that a program of your own defines, and that has no file.
pub struct Own {
    name: String,
    tree: Table,
    prepare: Box<Prepare>,
}

/// Makes the factory of a controller for a robot and a control period (s).
type Prepare = dyn Fn(&Robot, f64) -> Result<PreparedController> + Send + Sync;

impl Own {
    /// `tree` holds all numbers on which the controller depends: a result with other numbers is another result.
    /// `prepare` makes the factory for a robot and a control period (s).
    pub fn new(
        name: impl Into<String>,
        tree: Table,
        prepare: impl Fn(&Robot, f64) -> Result<PreparedController> + Send + Sync + 'static,
    ) -> Box<Self> {
        Box::new(Self {
            name: name.into(),
            tree,
            prepare: Box::new(prepare),
        })
    }
}

impl Debug for Own {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Own({}, {:?})", self.name, self.tree)
    }
}

impl ControllerSpec for Own {
    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, _file: &str) -> Result<()> {
        Ok(())
    }

    fn tree(&self) -> Table {
        self.tree.clone()
    }

    fn prepare(&self, robot: &Robot, period_s: f64) -> Result<PreparedController> {
        (self.prepare)(robot, period_s)
    }
}
