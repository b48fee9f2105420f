//! The socket between a robot and its controllers: what a controller is ([`Controller`]), what it reads ([`Sensed`]) and what
//! it writes ([`Command`]).

mod controller;
mod home_command;
mod io;

pub use controller::{
    Airborne, Controller, PreparedController, Promise, RecoveryRegion, Report, TickError,
};
pub use io::{Command, CommandError, Imu, Sensed, SensedError, Wrench};
