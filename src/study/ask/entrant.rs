//! An entrant: a controller in a physics engine, as campaigns and the command line list it.

use standfast_controllers::variant::ControllerName;
use standfast_core::error::{Error, Result};
use standfast_sim::Engine;

/// An entrant as it is listed: `catch`, `mine.toml:zmp_margin=0.001`, or either with the name of an engine behind it, as
/// in `catch@mujoco`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entrant<'a> {
    /// The controller as it is listed, without the engine.
    pub controller: &'a str,
    /// None if the engine is that of the campaign.
    pub engine: Option<Engine>,
}

impl<'a> Entrant<'a> {
    /// Splits at the last `@` that the name of an engine follows.
    pub fn split(listed: &'a str) -> Self {
        let split = listed
            .rsplit_once('@')
            .and_then(|(controller, name)| Some((controller, Engine::named(name.trim())?)));
        match split {
            Some((controller, engine)) => Self {
                controller: controller.trim_end(),
                engine: Some(engine),
            },
            None => Self {
                controller: listed,
                engine: None,
            },
        }
    }

    /// Name, or path, and change of the controller.
    pub fn controller_name(&self) -> ControllerName<'a> {
        ControllerName::split(self.controller)
    }

    /// The entrant of another controller in the same engine. With the name of its controller it is its own name in the
    /// results.
    pub fn of(&self, controller: &str) -> String {
        match self.engine {
            Some(engine) => format!("{controller}@{}", engine.name()),
            None => controller.into(),
        }
    }

    /// Fails if a word behind an `@` is no engine. Errors name `file`.
    pub fn check(listed: &str, file: &str) -> Result<()> {
        match listed.rsplit_once('@') {
            Some((_, name))
                if name.chars().all(|c| c.is_ascii_alphanumeric())
                    && Engine::named(name).is_none() =>
            {
                let accepted = Engine::ALL.map(Engine::name).join(", ");
                Err(Error::value(
                    file,
                    "controller",
                    listed,
                    "names an unknown engine",
                    accepted,
                ))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_engine_stands_behind_the_last_at() {
        let (rapier, mujoco) = (Some(Engine::Rapier), Some(Engine::Mujoco));
        for (listed, controller, engine) in [
            ("catch", "catch", None),
            ("catch@mujoco", "catch", mujoco),
            ("me@home/g.toml", "me@home/g.toml", None),
            ("me@home/g.toml@rapier", "me@home/g.toml", rapier),
            (
                "paper:zmp_margin=0.1@mujoco",
                "paper:zmp_margin=0.1",
                mujoco,
            ),
        ] {
            let entrant = Entrant::split(listed);
            assert_eq!((entrant.controller, entrant.engine), (controller, engine));
            assert_eq!(entrant.of(controller), listed);
            assert!(Entrant::check(listed, "").is_ok());
        }
        let error = Entrant::check("catch@bullet", "a.toml")
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("catch@bullet") && error.contains("rapier, mujoco"),
            "{error}"
        );
    }
}
