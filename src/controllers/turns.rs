//! Turns to compute. A controller that answers to many episodes at once needs more open episodes than there are cores, so
//! jobs run on more threads than may compute. A job runs [`in_turn`], and its controller gives the turn away while it
//! waits for an answer.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

thread_local! {
    static TURNS: RefCell<Option<Arc<Turns>>> = const { RefCell::new(None) };
    static HAS_TURN: Cell<bool> = const { Cell::new(false) };
    static SELF: Arc<Waiter> = Arc::default();
}

/// The turns of a pool of threads.
#[derive(Debug)]
pub struct Turns {
    most: usize,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    free: usize,
    /// Threads that could go on, and get the next turns.
    ready: VecDeque<Arc<Waiter>>,
}

/// A thread that waits until it may go on.
#[derive(Debug, Default)]
pub(super) struct Waiter {
    may_go: Mutex<bool>,
    go: Condvar,
}

impl Waiter {
    /// The waiter of this thread.
    pub fn of_this_thread() -> Arc<Self> {
        SELF.with(Arc::clone)
    }

    pub fn go(&self) {
        *locked(&self.may_go) = true;
        self.go.notify_one();
    }

    pub fn wait(&self) {
        let waits = self.go.wait_while(locked(&self.may_go), |may_go| !*may_go);
        *waits.unwrap_or_else(PoisonError::into_inner) = false;
    }
}

impl Turns {
    /// Turns for `most` threads at once.
    pub fn new(most: usize) -> Self {
        let (free, ready) = (most, VecDeque::new());
        Self {
            most,
            state: Mutex::new(State { free, ready }),
        }
    }

    /// Lets a thread go on as soon as there is a turn for it.
    pub(super) fn ask(&self, waiter: &Arc<Waiter>) {
        let mut state = locked(&self.state);
        if state.free == 0 {
            state.ready.push_back(Arc::clone(waiter));
            return;
        }
        state.free -= 1;
        drop(state);
        waiter.go();
    }

    /// Gives the turn of this thread away. The thread gets another one by [asking](Self::ask) for it.
    pub(super) fn give(&self) {
        let mut state = locked(&self.state);
        let Some(next) = state.ready.pop_front() else {
            state.free += 1;
            return;
        };
        drop(state);
        next.go();
    }

    /// Whether nobody computes.
    pub(super) fn are_idle(&self) -> bool {
        locked(&self.state).free == self.most
    }
}

/// Largest number of threads for a controller that wants `open` episodes at once.
pub fn most_threads(open: usize) -> usize {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    open.max(4 * cores)
}

/// From now on this thread runs its jobs in these turns.
pub fn take_part(turns: Arc<Turns>) {
    TURNS.set(Some(turns));
}

/// Runs a job when it is this thread's turn. A thread that takes no part in turns runs it at once.
pub fn in_turn<T>(job: impl FnOnce() -> T) -> T {
    let turns = TURNS.with_borrow(Clone::clone);
    let Some(turns) = turns.filter(|_| !HAS_TURN.get()) else {
        return job();
    };
    /// Gives the turn away at the end, also after a panic.
    struct Turn(Arc<Turns>);
    impl Drop for Turn {
        fn drop(&mut self) {
            HAS_TURN.set(false);
            self.0.give();
        }
    }
    let waiter = Waiter::of_this_thread();
    turns.ask(&waiter);
    waiter.wait();
    HAS_TURN.set(true);
    let _turn = Turn(turns);
    job()
}

/// The turns in which this thread computes now; None if it takes no part in any.
pub(super) fn present() -> Option<Arc<Turns>> {
    let turns = TURNS.with_borrow(Clone::clone);
    turns.filter(|_| HAS_TURN.get())
}

pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    /// Sixteen threads share two turns: never more than two compute, also where they wait within a job.
    #[test]
    fn no_more_threads_compute_than_there_are_turns() {
        let turns = Arc::new(Turns::new(2));
        let (computing, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let compute = || {
            let now = computing.fetch_add(1, Ordering::SeqCst) + 1;
            most.fetch_max(now, Ordering::SeqCst);
            thread::sleep(Duration::from_millis(1));
            computing.fetch_sub(1, Ordering::SeqCst);
        };
        thread::scope(|scope| {
            for _ in 0..16 {
                scope.spawn(|| {
                    take_part(Arc::clone(&turns));
                    for _ in 0..5 {
                        in_turn(|| {
                            compute();
                            let (present, waiter) = (present().unwrap(), Waiter::of_this_thread());
                            // Somebody answers later.
                            let answer = thread::spawn({
                                let present = Arc::clone(&present);
                                move || present.ask(&waiter)
                            });
                            present.give();
                            Waiter::of_this_thread().wait();
                            answer.join().unwrap();
                            in_turn(compute);
                        });
                    }
                });
            }
        });
        assert_eq!(most.into_inner(), 2);
        assert!(turns.are_idle());
    }

    #[test]
    fn a_turn_is_given_away_after_a_panic() {
        let turns = Arc::new(Turns::new(1));
        let job = {
            let turns = Arc::clone(&turns);
            move || {
                take_part(turns);
                in_turn(|| panic!("within a job"))
            }
        };
        assert!(thread::spawn(job).join().is_err());
        assert!(turns.are_idle());
    }
}
