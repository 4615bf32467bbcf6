//! Values that follow from a key, such as tables that follow from the light: computed in the frame, or in the background.
//!
//! The work runs in Bevy's `AsyncComputeTaskPool`, where the light itself is computed: dropping a task cancels it, and no
//! bake runs there, so it is never queued behind one. What the work does in parallel goes to rayon's global pool, which a
//! frame uses for short work only.

use bevy::tasks::{AsyncComputeTaskPool, Task, block_on, poll_once};

use super::components::LightUpdates;

/// A value, the key that it was computed for, and the computation of the next one.
pub struct Follower<K, T> {
    shown: Option<(K, T)>,
    task: Option<(K, Task<T>)>,
}

impl<K, T> Default for Follower<K, T> {
    fn default() -> Self {
        Self { shown: None, task: None }
    }
}

/// What [`Follower::follow`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Followed {
    /// The value is that of the key, and not a new one.
    Same,
    /// The value is new: the frame waited for it.
    Waited,
    /// The value is new: it was computed in the background.
    Taken,
    /// The value is not new, and lags behind the key.
    Lags,
}

impl<K: Clone + PartialEq, T: Send + 'static> Follower<K, T> {
    /// Brings the value to `key` by `compute`, or towards it: with [`LightUpdates::Background`] it may lag as long as it
    /// was computed for a key that is `near` enough. Only the first value is always waited for.
    ///
    /// One computation runs at a time, for the key of the frame in which it was started.
    pub fn follow(
        &mut self,
        key: &K,
        updates: LightUpdates,
        near: impl Fn(&K) -> bool,
        compute: impl FnOnce() -> T + Send + 'static,
    ) -> Followed {
        if self.is_of(key) {
            self.task = None;
            return Followed::Same;
        }
        let mut taken = Followed::Lags;
        if let Some((of, mut task)) = self.task.take() {
            match block_on(poll_once(&mut task)) {
                Some(value) => {
                    self.shown = Some((of, value));
                    taken = Followed::Taken;
                }
                None => self.task = Some((of, task)),
            }
        }
        if self.is_of(key) {
            return taken;
        }
        let pool = AsyncComputeTaskPool::try_get();
        let may_lag = updates == LightUpdates::Background && self.shown.as_ref().is_some_and(|(of, _)| near(of));
        match pool {
            Some(pool) if may_lag => {
                if self.task.is_none() {
                    self.task = Some((key.clone(), pool.spawn(async move { compute() })));
                }
                taken
            }
            _ => {
                let value = match self.task.take() {
                    Some((of, task)) if of == *key => block_on(task),
                    _ => compute(),
                };
                self.shown = Some((key.clone(), value));
                Followed::Waited
            }
        }
    }

    /// The value.
    pub fn value(&self) -> Option<&T> {
        self.shown.as_ref().map(|(_, value)| value)
    }

    /// The key that the value was computed for.
    pub fn key(&self) -> Option<&K> {
        self.shown.as_ref().map(|(key, _)| key)
    }

    fn is_of(&self, key: &K) -> bool {
        self.key() == Some(key)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{
        Arc,
        mpsc::{Receiver, Sender, channel},
    };

    use bevy::tasks::TaskPool;

    use super::*;

    /// A computation that gives ten times its key when it is released.
    fn held(key: i32) -> (Sender<()>, impl FnOnce() -> i32 + Send + 'static) {
        let (release, released): (Sender<()>, Receiver<()>) = channel();
        (release, move || {
            released.recv().ok();
            10 * key
        })
    }

    fn near(key: i32) -> impl Fn(&i32) -> bool {
        move |of| key.abs_diff(*of) <= 3
    }

    fn forbidden() -> i32 {
        panic!("nothing is to be computed")
    }

    /// Asks for `key` until the value is that of `of`.
    fn until(follower: &mut Follower<i32, i32>, key: i32, of: i32) {
        while follower.key() != Some(&of) {
            assert_ne!(follower.follow(&key, LightUpdates::Background, near(key), move || 10 * key), Followed::Waited);
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_frame_that_may_not_lag_computes() {
        let mut follower = Follower::default();
        for key in [1, 2, 3] {
            assert_eq!(follower.follow(&key, LightUpdates::Blocking, near(key), move || 10 * key), Followed::Waited);
            assert_eq!(follower.value(), Some(&(10 * key)));
            assert_eq!(follower.follow(&key, LightUpdates::Blocking, near(key), forbidden), Followed::Same);
        }
    }

    #[test]
    fn in_the_background_the_last_value_stays_until_the_next_is_there() {
        AsyncComputeTaskPool::get_or_init(TaskPool::new);
        let mut follower = Follower::default();
        let background = LightUpdates::Background;
        // The first one is waited for: there is nothing else to draw.
        assert_eq!(follower.follow(&1, background, near(1), || 10), Followed::Waited);
        let (release, compute) = held(2);
        assert_eq!(follower.follow(&2, background, near(2), compute), Followed::Lags);
        // The key moves on while the task runs; no second one is started.
        for key in [2, 3, 4] {
            assert_eq!(follower.follow(&key, background, near(key), forbidden), Followed::Lags);
            assert_eq!(follower.value(), Some(&10));
        }
        drop(release);
        until(&mut follower, 4, 2);
        until(&mut follower, 4, 4);
        assert_eq!(follower.value(), Some(&40));
        assert_eq!(follower.follow(&4, background, near(4), forbidden), Followed::Same);
    }

    #[test]
    fn a_key_that_is_too_far_is_waited_for() {
        AsyncComputeTaskPool::get_or_init(TaskPool::new);
        let mut follower = Follower::default();
        let background = LightUpdates::Background;
        follower.follow(&1, background, near(1), || 10);
        let (release, compute) = held(4);
        assert_eq!(follower.follow(&4, background, near(4), compute), Followed::Lags);
        // Another key than that of the task: the task is given up, unfinished.
        assert_eq!(follower.follow(&5, background, near(5), || 50), Followed::Waited);
        assert_eq!((follower.key(), follower.value()), (Some(&5), Some(&50)));
        drop(release);
        // Its own key: the frame waits for the task.
        let (release, compute) = held(6);
        assert_eq!(follower.follow(&6, background, near(6), compute), Followed::Lags);
        drop(release);
        assert_ne!(follower.follow(&6, LightUpdates::Blocking, near(6), forbidden), Followed::Lags);
        assert_eq!((follower.key(), follower.value()), (Some(&6), Some(&60)));
    }

    #[test]
    fn a_key_that_comes_back_needs_nothing() {
        AsyncComputeTaskPool::get_or_init(TaskPool::new);
        let mut follower: Follower<i32, i32> = Follower::default();
        let background = LightUpdates::Background;
        follower.follow(&1, background, near(1), || 10);
        let content = Arc::new(());
        let task = content.clone();
        let (release, compute) = held(2);
        let compute = move || {
            let _task = task;
            compute()
        };
        assert_eq!(follower.follow(&2, background, near(2), compute), Followed::Lags);
        assert_eq!(follower.follow(&1, background, near(1), forbidden), Followed::Same);
        drop(release);
        assert_eq!((follower.key(), follower.value()), (Some(&1), Some(&10)));
    }
}
