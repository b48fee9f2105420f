//! Replays: what their pages contain, and what a browser makes of it.

mod common;
mod replay_data;
mod replay_html;
