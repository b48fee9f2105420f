//! The guide: short chapters on how to use the program, why it says what it says, and what has been measured with it.
//!
//! 1. [`campaigns`]: what a campaign draws, every table of a result, and how sure it is
//! 2. [`gates`]: a build fails if the robot stands worse
//! 3. [`clusters`]: many machines, and what can go wrong
//! 4. [`limits`]: the hardest push by heading, what a pendulum allows, and what could have been caught
//! 5. [`robots`]: robots that are not as designed, your own robot, and the controller alone as a library
//! 6. [`gains`]: your own controller, or your own settings of ours
//! 7. [`paper`]: the paper's scenarios, and where this program departs from the paper
//! 8. [`measured`]: what holds now, one table a question; [`history`]: what was measured over time, and what was tried
//! 9. [`engines`]: what depends on the physics engine, and what does not
//! 10. [`watching`]: replays, pictures and the window
//! 11. [`commands`]: every command with examples, and the exit codes
//! 12. [`process`]: your own controller in Python, or in any other language
//! 13. [`onnx`]: policies that were learned elsewhere, as ONNX files
//! 14. [`columns`]: what the columns of trials and traces mean
//! 15. [`data`]: results in pandas, polars and DuckDB, and traces in Foxglove
//! 16. [`tuning`]: from a controller to a better one
//! 17. [`baselines`]: what public policies survived, to compare yours with
//! 18. [`published`]: pushes that others published, beside the pendulum bounds
//! 19. [`card`]: one page for a lab, pushes to try on hardware, and whether hardware agrees
//!
//! The chapters are Markdown files beside this one, to be read in the repository or here.

/// Makes a module of each chapter. A chapter names the targets of its links at its end, as files, which is right for a
/// reader of the repository. Here the same names are given other targets first, and in Markdown the first target of a
/// name counts. Pictures are found from where `cargo doc` writes a page, which is `target/doc/standfast/guide/CHAPTER/`.
macro_rules! chapters {
    ($($chapter:ident)*) => { $(
        #[doc = "[README]: ../../../../../README.md"]
        #[doc = "[baselines]: crate::guide::baselines"]
        #[doc = "[campaigns]: crate::guide::campaigns"]
        #[doc = "[card]: crate::guide::card"]
        #[doc = "[clusters]: crate::guide::clusters"]
        #[doc = "[commands]: crate::guide::commands"]
        #[doc = "[columns]: crate::guide::columns"]
        #[doc = "[data]: crate::guide::data"]
        #[doc = "[engines]: crate::guide::engines"]
        #[doc = "[gains]: crate::guide::gains"]
        #[doc = "[gates]: crate::guide::gates"]
        #[doc = "[limits]: crate::guide::limits"]
        #[doc = "[measured]: crate::guide::measured"]
        #[doc = "[history]: crate::guide::history"]
        #[doc = "[above]: crate::guide::history#above-the-bound"]
        #[doc = "[beyond]: crate::guide::history#just-beyond-the-limit"]
        #[doc = "[build]: crate::guide::history#what-the-build-costs"]
        #[doc = "[follows]: crate::guide::history#whether-the-zmp-follows"]
        #[doc = "[laws]: crate::guide::history#whether-the-physics-adds-up"]
        #[doc = "[others]: crate::guide::history#other-robots"]
        #[doc = "[parts]: crate::guide::history#what-each-part-of-catch-is-worth"]
        #[doc = "[leg]: crate::guide::history#the-swing-leg-is-led-with-the-trunk-as-it-is-and-feet-land-farther"]
        #[doc = "[turn]: crate::guide::history#the-trunk-turns-while-the-legs-cross"]
        #[doc = "[rise]: crate::guide::history#a-straight-leg-that-is-lifted-does-not-throw-the-body-up"]
        #[doc = "[hang]: crate::guide::history#a-hanging-foot-swings-from-where-it-is-and-the-trunk-stays-half-turned"]
        #[doc = "[wide]: crate::guide::history#the-loaded-foot-goes-out-to-the-side"]
        #[doc = "[early]: crate::guide::history#footsteps-land-early"]
        #[doc = "[spread]: crate::guide::history#a-limit-is-over-headings-too"]
        #[doc = "[rolls]: crate::guide::history#soles-roll-where-an-ankle-is-at-its-limit"]
        #[doc = "[travel]: crate::guide::history#a-swing-takes-longer-with-its-travel"]
        #[doc = "[sizes]: crate::guide::history#robots-of-other-sizes"]
        #[doc = "[speed]: crate::guide::history#speed"]
        #[doc = "[step]: crate::guide::history#the-physics-step"]
        #[doc = "[varied]: crate::guide::history#under-the-variations-of-standard"]
        #[doc = "[figures]: ../../../../../assets/figures.json"]
        #[doc = "[seeds]: ../../../../../assets/seeds.toml"]
        #[doc = "[clairvoyant]: crate::guide::history#what-a-clairvoyant-does-otherwise"]
        #[doc = "[caught]: crate::guide::limits#what-could-have-been-caught"]
        #[doc = "[estimate]: crate::guide::history#the-estimate-in-flight-and-at-landing"]
        #[doc = "[robust-sets]: crate::guide::history#robust-sets"]
        #[doc = "[onnx]: crate::guide::onnx"]
        #[doc = "[paper]: crate::guide::paper"]
        #[doc = "[process]: crate::guide::process"]
        #[doc = "[pendulum]: crate::guide::limits#a-pendulum-as-it-hangs-in-a-lab"]
        #[doc = "[protocols]: crate::guide::limits#the-protocols-of-robocup-and-dysturbance"]
        #[doc = "[published]: crate::guide::published"]
        #[doc = "[robots]: crate::guide::robots"]
        #[doc = "[tuned]: crate::guide::history#with-numbers-of-their-own"]
        #[doc = "[tuning]: crate::guide::tuning"]
        #[doc = "[error-backward.svg]: ../../../../../assets/pictures/error-backward.svg"]
        #[doc = "[error-diagonal.svg]: ../../../../../assets/pictures/error-diagonal.svg"]
        #[doc = "[gauge.svg]: ../../../../../assets/pictures/gauge.svg"]
        #[doc = "[ghost.png]: ../../../../../assets/pictures/ghost.png"]
        #[doc = "[limit-nominal.svg]: ../../../../../assets/pictures/limit-nominal.svg"]
        #[doc = "[map-nominal.svg]: ../../../../../assets/pictures/map-nominal.svg"]
        #[doc = "[limit-standard.svg]: ../../../../../assets/pictures/limit-standard.svg"]
        #[doc = "[loss-46.svg]: ../../../../../assets/pictures/loss-46.svg"]
        #[doc = "[loss-579.svg]: ../../../../../assets/pictures/loss-579.svg"]
        #[doc = "[loss-630.svg]: ../../../../../assets/pictures/loss-630.svg"]
        #[doc = "[push-behind.svg]: ../../../../../assets/pictures/push-behind.svg"]
        #[doc = "[push-diagonal.svg]: ../../../../../assets/pictures/push-diagonal.svg"]
        #[doc = "[replay.png]: ../../../../../assets/pictures/replay.png"]
        #[doc = "[report.png]: ../../../../../assets/pictures/report.png"]
        #[doc = "[rise-caught.svg]: ../../../../../assets/pictures/rise-caught.svg"]
        #[doc = "[rise-lost.svg]: ../../../../../assets/pictures/rise-lost.svg"]
        #[doc = "[hang-caught.svg]: ../../../../../assets/pictures/hang-caught.svg"]
        #[doc = "[hang-lost.svg]: ../../../../../assets/pictures/hang-lost.svg"]
        #[doc = "[success.svg]: ../../../../../assets/pictures/success.svg"]
        #[doc = "[travel-caught.svg]: ../../../../../assets/pictures/travel-caught.svg"]
        #[doc = "[travel-lost.svg]: ../../../../../assets/pictures/travel-lost.svg"]
        #[doc = "[turn-caught.svg]: ../../../../../assets/pictures/turn-caught.svg"]
        #[doc = "[turn-lost.svg]: ../../../../../assets/pictures/turn-lost.svg"]
        #[doc = "[view.png]: ../../../../../assets/pictures/view.png"]
        #[doc = "[wide-caught.svg]: ../../../../../assets/pictures/wide-caught.svg"]
        #[doc = "[wide-lost.svg]: ../../../../../assets/pictures/wide-lost.svg"]
        #[doc = ""]
        #[doc = include_str!(concat!(stringify!($chapter), ".md"))]
        pub mod $chapter {}
    )* };
}

chapters! { campaigns gates clusters limits robots gains paper measured history engines watching commands process onnx columns data tuning baselines published card }
