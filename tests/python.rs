//! Objects of a Python process as controllers: the tests are in Python (`tests/python/loop.py`), and each runs the program that
//! is tested here.

use crate::common::program::{PROGRAM, folder};
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Runs one of the tests in Python, if there is Python.
fn passes(test: &str) {
    let dir = folder();
    let run = Command::new("python3")
        .arg(format!("{ROOT}/tests/python/loop.py"))
        .arg(test)
        .current_dir(dir.path())
        .env("PYTHONPATH", format!("{ROOT}/assets/python"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("STANDFAST_PROGRAM", PROGRAM)
        .output();
    let Ok(run) = run else {
        eprintln!("left out: there is no python3");
        return;
    };
    let told = [run.stdout, run.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(
        run.status.success() && told[0].contains("is fine"),
        "{}",
        told.concat()
    );
}

/// A test here for each of these in Python. Those that are marked take long.
macro_rules! in_python {
    ($($(#[$mark:meta])? $name:ident)*) => {
        $(#[test]
        $(#[$mark])?
        fn $name() {
            passes(concat!("test_", stringify!($name)));
        })*

        #[test]
        fn all_tests_in_python_are_run() {
            let text = std::fs::read_to_string(format!("{ROOT}/tests/python/loop.py")).unwrap();
            let there = text.lines().filter_map(|line| line.strip_prefix("def test_"));
            let there: Vec<&str> = there.filter_map(|line| line.split('(').next()).collect();
            assert_eq!(there, [$(stringify!($name)),*]);
        }
    };
}

in_python! {
    rows_are_the_same_for_any_threads_and_batch
    a_network_gives_the_same_rows_for_any_threads
    batches_are_full
    an_exception_reaches_the_caller
    another_shape_is_said
    #[ignore = ".ci/try-wheel runs it"]
    gains_may_be_left_out_in_a_row
    a_tick_without_angles_is_said
    #[ignore = ".ci/try-wheel runs it"]
    an_object_with_a_memory_is_asked_for_many_runs
    #[ignore = ".ci/try-wheel runs it"]
    what_is_complete_is_kept
    errors_of_a_connection_are_raised
    the_greeting_is_given_to_who_takes_it
    a_command_that_is_no_number_ends_its_episode_alone
    a_long_call_meets_the_timeout
    ctrl_c_ends_the_run
    #[ignore = ".ci/try-wheel runs it"]
    with_a_version_a_run_goes_on
    #[ignore = ".ci/try-wheel runs it"]
    another_process_says_that_the_object_is_gone
    #[ignore = ".ci/try-wheel runs it"]
    a_check_finds_rows_that_depend_on_others
    #[ignore = ".ci/try-wheel runs it"]
    push_limit_and_pages
    numbers_of_any_kind_are_taken
    examples_do_what_they_say
}
