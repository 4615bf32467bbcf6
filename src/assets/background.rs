//! Background work on its own threads: loads, bakes, and the builds of forests and scenes.
//!
//! Bevy's task pools are not used: a bake would block their few threads for seconds while other loads wait. Neither is
//! rayon's global pool: the frames' own work (the sky's tables, the tiles) would queue up behind the bake. There is one
//! thread per core but one; the first work starts them, and all work shares them. The work runs on a thread of the
//! pool, so rayon's parallel iterators inside it stay in this pool as well. Cancelled work does not start, and running
//! work can check whether it is still needed. A program that exits does not wait for the threads.

use std::{
    any::Any,
    future::Future,
    panic::{AssertUnwindSafe, catch_unwind},
    pin::Pin,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak},
    task::{Context, Poll, Waker},
};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::threads::spare_cores;

/// Stack size of a thread. A thread that waits for a part of its work may start other work meanwhile, on the same
/// stack.
const STACK: usize = 16 << 20;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BackgroundError {
    /// The system cannot create threads.
    #[error("cannot create threads for background work: {0}; close other programs")]
    NoThreads(String),
    /// The work panicked.
    #[error("an error in the program: {0}")]
    BrokeOff(String),
}

/// Work in progress. It can be awaited as a [`Future`], or polled with [`finished`](Self::finished). Dropping it
/// cancels it.
#[derive(Debug)]
pub struct Background<T>(Arc<Shared<T>>);

#[derive(Debug)]
struct Shared<T>(Mutex<State<T>>);

#[derive(Debug)]
struct State<T> {
    result: Option<Result<T, BackgroundError>>,
    waker: Option<Waker>,
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn finish(&self, result: Result<T, BackgroundError>) {
        let waker = {
            let mut state = self.lock();
            state.result = Some(result);
            state.waker.take()
        };
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

/// Whether the result of some work is still needed.
pub struct Wanted<'a>(&'a (dyn Fn() -> bool + Sync));

impl Wanted<'_> {
    /// Whether it is still needed.
    pub fn is_wanted(&self) -> bool {
        (self.0)()
    }
}

/// Starts `work`.
pub fn start<T: Send + 'static>(work: impl FnOnce(&Wanted) -> T + Send + 'static) -> Background<T> {
    let shared = Arc::new(Shared(Mutex::new(State { result: None, waker: None })));
    let line: Weak<Shared<T>> = Arc::downgrade(&shared);
    match pool() {
        Ok(pool) => pool.spawn(move || {
            let wanted = || line.strong_count() > 0;
            if !wanted() {
                return;
            }
            // A panic would end the process; here only this work fails.
            let result = catch_unwind(AssertUnwindSafe(|| work(&Wanted(&wanted))));
            if let Some(shared) = line.upgrade() {
                shared.finish(result.map_err(|panic| BackgroundError::BrokeOff(message(&*panic))));
            }
        }),
        Err(error) => shared.finish(Err(error)),
    }
    Background(shared)
}

impl<T> Background<T> {
    /// The result, once; `None` while the work goes on, and after the result was taken.
    pub fn finished(&self) -> Option<Result<T, BackgroundError>> {
        self.0.lock().result.take()
    }
}

impl<T> Future for Background<T> {
    type Output = Result<T, BackgroundError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut state = self.0.lock();
        match state.result.take() {
            Some(result) => Poll::Ready(result),
            None => {
                state.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

fn pool() -> Result<&'static ThreadPool, BackgroundError> {
    static POOL: OnceLock<Result<ThreadPool, BackgroundError>> = OnceLock::new();
    let pool = POOL.get_or_init(|| {
        let name = |index| format!("canopy background {index}");
        let pool = ThreadPoolBuilder::new().num_threads(spare_cores()).stack_size(STACK).thread_name(name).build();
        pool.map_err(|error| BackgroundError::NoThreads(error.to_string()))
    });
    pool.as_ref().map_err(Clone::clone)
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("(see above)").to_owned()
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use bevy::tasks::block_on;
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn work_is_done_and_awaited() {
        assert_eq!(block_on(start(|wanted| (wanted.is_wanted(), 6 * 7))), Ok((true, 42)));
    }

    #[test]
    fn a_panic_is_an_error_of_the_work_alone() {
        let broken = block_on(start(|_| -> u32 { panic!("index out of bounds") }));
        assert_eq!(broken, Err(BackgroundError::BrokeOff("index out of bounds".to_owned())));
        assert_eq!(block_on(start(|_| 1)), Ok(1));
    }

    #[test]
    fn a_panic_becomes_a_message() {
        let text = |panic: &(dyn Any + Send)| BackgroundError::BrokeOff(message(panic)).to_string();
        assert_eq!(text(&"index out of bounds"), "an error in the program: index out of bounds");
        assert_eq!(text(&String::from("x")), "an error in the program: x");
        assert_eq!(text(&1), "an error in the program: (see above)");
    }

    #[test]
    fn nested_parallel_work_stays_on_the_background_threads() {
        let names = block_on(start(|_| {
            let name = |_| std::thread::current().name().unwrap_or_default().to_owned();
            (0..64).into_par_iter().map(name).collect::<Vec<_>>()
        }));
        let names = names.unwrap_or_default();
        assert_eq!(names.len(), 64);
        assert!(names.iter().all(|name| name.starts_with("canopy background ")), "{names:?}");
    }

    #[test]
    fn work_sees_that_it_was_cancelled() {
        let (begun, at_work) = channel();
        let (go_on, dropped) = channel::<()>();
        let (sender, answer) = channel();
        let work = start(move |wanted| {
            let _ = begun.send(wanted.is_wanted());
            let _ = dropped.recv();
            let _ = sender.send(wanted.is_wanted());
        });
        assert_eq!(at_work.recv(), Ok(true));
        drop(work);
        let _ = go_on.send(());
        assert_eq!(answer.recv(), Ok(false));
    }
}
