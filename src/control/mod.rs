//! The controller: estimate, support, supervisor, whole body. It sees `Sensed` and answers with a `Command`.
