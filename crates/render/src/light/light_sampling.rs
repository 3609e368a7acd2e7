//! Which light to sample: how often each kind of them is chosen, and how often each light.

use crate::light::tree::MOST_AT_A_POINT;
use crate::light::tree::importance::{Asker, Weights};
use crate::light::tree::node::{Below, Node};
use crate::light::{Lights, Reference, Source};

/// How often each light is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// By how much it may matter to the point that is lit.
    Weighed,
    /// As often as any other: asked for [`Lights::count`] samples with evenly spread numbers, each once. Surfaces that
    /// shine count as one.
    Even,
    /// Each of those infinitely far away, some of the others, and surfaces that shine: by [`Lights::sample_each`].
    Several,
}

/// The most directions that [`Lights::sample_each`] tells of.
pub(crate) const MOST_AT_ONCE: usize = 2 * MOST_AT_A_POINT + 1;

/// A point that is lit, and what is known of the trees over lights there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Askers<'a> {
    pub from: &'a Reference,
    /// Of lights without a mesh, and of surfaces that shine; see [`Lights::small_trees`].
    pub known: [Option<(&'a Weights, usize)>; 2],
}

impl<'a> From<&'a Reference> for Askers<'a> {
    fn from(from: &'a Reference) -> Self {
        Self {
            from,
            known: [None; 2],
        }
    }
}

impl<'a> Askers<'a> {
    pub(crate) fn finite(&self) -> Asker<'a> {
        Asker {
            from: self.from,
            known: self.known[0],
        }
    }

    pub(crate) fn surfaces(&self) -> Asker<'a> {
        Asker {
            from: self.from,
            known: self.known[1],
        }
    }
}

/// Probabilities that add up to 1 over all lights, unless each kind is sampled.
pub(crate) struct Odds {
    /// How many of those infinitely far away are chosen at all.
    pub sought: usize,
    /// Of each of them.
    pub infinite: f64,
    /// Of all others without a mesh together.
    pub finite: f64,
    /// Of all surfaces that shine together.
    pub surfaces: f64,
}

impl Lights {
    /// Whether [`Lights::sample`] ever finds anything.
    pub fn is_sampled(&self, choice: Choice) -> bool {
        choice == Choice::Even || self.uneven > 0 || !self.tree.is_empty() || self.has_surfaces()
    }

    /// Whether [`Lights::sample`] needs the first of its numbers, which chooses among lights.
    pub fn is_chosen(&self, choice: Choice) -> bool {
        match choice {
            Choice::Even => self.count() > 1,
            Choice::Weighed | Choice::Several => {
                self.has_surfaces() || self.uneven + self.tree.count() > 1
            }
        }
    }

    /// The light that [`Lights::sample`] always chooses, where there is one.
    pub fn only(&self, choice: Choice) -> Option<&Source> {
        let one = self.uneven == 0 && self.tree.count() == 1 && !self.has_surfaces();
        let [Below::Light(light)] = *self.tree.only_node()?.below() else {
            return None;
        };
        let only = &self.sources[self.finite[light as usize]];
        (one && choice == Choice::Weighed).then_some(only)
    }

    /// Whether the only light is one that is infinitely far away and uneven: then there is nothing to choose.
    pub(crate) fn is_alone(&self, choice: Choice) -> bool {
        let one = self.uneven == 1 && self.infinite.len() == 1 && self.finite.is_empty();
        one && choice == Choice::Weighed && !self.has_surfaces()
    }

    /// The most directions that [`Lights::sample_each`] tells of, if there is more than one kind of light to tell apart and
    /// not too much of what is infinitely far away.
    pub fn most_at_once(&self) -> Option<usize> {
        let several = self.uneven + self.tree.count() + usize::from(self.has_surfaces()) > 1;
        (several && self.uneven <= MOST_AT_A_POINT).then_some(self.uneven + MOST_AT_A_POINT + 1)
    }

    /// What [`Askers::known`] takes for many points at a time: of lights without a mesh and of surfaces that shine, the node
    /// that is all of the tree over them, where there is something to choose in it.
    pub fn small_trees(&self, choice: Choice) -> [Option<&Node>; 2] {
        let finite = self.tree.only_node().filter(|_| choice != Choice::Even);
        [finite, self.surfaces.tree().only_node()]
            .map(|node| node.filter(|node| node.below().len() > 1))
    }

    /// Whether [`Lights::sample_each`] may tell of a direction with this number.
    pub fn tells(&self, index: usize) -> bool {
        let surfaces = self.uneven + MOST_AT_A_POINT;
        index < self.uneven + self.tree.count().min(MOST_AT_A_POINT)
            || (index == surfaces && self.has_surfaces())
    }

    /// One of the lights without a mesh that are not infinitely far away, by a number in 0..1, and its probability.
    pub(crate) fn choose(&self, from: &Asker, choice: Choice, number: f64) -> Option<(usize, f64)> {
        if choice == Choice::Even {
            let count = self.finite.len();
            let index = (number * count as f64) as usize;
            return Some((index.min(count - 1), 1.0 / count as f64));
        }
        self.tree.choose(from, number)
    }

    /// The probability with which such a light is chosen among them, or how many of it are expected.
    pub(crate) fn probability(&self, from: &Reference, choice: Choice, light: usize) -> f64 {
        match choice {
            Choice::Weighed => self.tree.probability(&from.into(), light),
            Choice::Even => 1.0 / self.finite.len() as f64,
            Choice::Several => self.tree.expected(&from.into(), light),
        }
    }

    /// With which probability each kind of light is chosen.
    pub(crate) fn odds(&self, from: &Reference, choice: Choice) -> Odds {
        let (near, shining) = (!self.tree.is_empty(), self.has_surfaces());
        match choice {
            Choice::Even => {
                let one = 1.0 / self.count().max(1) as f64;
                Odds {
                    sought: self.infinite.len(),
                    infinite: one,
                    finite: one * self.finite.len() as f64,
                    surfaces: if shining { one } else { 0.0 },
                }
            }
            Choice::Several => Odds {
                sought: self.uneven,
                infinite: 1.0,
                finite: 1.0,
                surfaces: 1.0,
            },
            Choice::Weighed => {
                // Scattered rays find even skies as well as any sample would.
                let sought = self.uneven;
                if sought == 0 && !(near && shining) {
                    return Odds {
                        sought,
                        infinite: 0.0,
                        finite: f64::from(u8::from(near)),
                        surfaces: f64::from(u8::from(shining)),
                    };
                }
                // Nothing says how much of what is infinitely far away arrives: each is as likely as all that is near.
                let near = [self.tree.importance(from), self.surfaces.importance(from)];
                let total = near[0] + near[1];
                let groups = sought + usize::from(total > 0.0);
                let one = 1.0 / groups.max(1) as f64;
                let [finite, surfaces] =
                    near.map(|part| if total > 0.0 { one * part / total } else { 0.0 });
                Odds {
                    sought,
                    infinite: one,
                    finite,
                    surfaces,
                }
            }
        }
    }
}
