//! Ctrl+Z: the user's last action is undone, if the run can go back so far.

use super::App;
use crate::hand::{Hand, Which};
use crate::samples::SECOND_HAND;
use crate::session::Order;

/// Something that can be taken back.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Act {
    /// Numbers were changed; the values are the earlier ones.
    Numbers(Vec<f64>),
    /// A pin was set.
    Pin,
    /// A pull began after this number of steps.
    Pull(u64),
}

impl App {
    /// Sends an action of the mouse's hand or of a pin, and remembers it for undo.
    pub(super) fn act(&mut self, hand: Hand) {
        self.act_with(self.mouse, hand);
    }

    /// Sends an action of a given hand or of a pin, and remembers it for undo.
    pub(super) fn act_with(&mut self, which: Which, hand: Hand) {
        match hand {
            Hand::Take(..) => {
                self.acts.push(Act::Pull(self.frame.steps));
                // The force of the first hand is plotted from the start.
                if which == Which::Second {
                    self.plotted.insert(SECOND_HAND.into());
                }
            }
            Hand::Pin(_) => self.acts.push(Act::Pin),
            _ => {}
        }
        self.order(match which {
            Which::First => Order::Hand(hand),
            Which::Second => Order::Second(hand),
        });
    }

    /// Undoes the last action: numbers and pins are restored, a pull by going back to an earlier state.
    pub(super) fn undo(&mut self) {
        match self.acts.pop() {
            Some(Act::Numbers(before)) => self.set_numbers(&before),
            Some(Act::Pin) => {
                if let Some(last) = self.frame.pins().len().checked_sub(1) {
                    self.order(Order::Hand(Hand::Unpin(last)));
                }
            }
            Some(Act::Pull(steps)) => {
                self.let_go();
                self.order(Order::Back(steps));
            }
            None => {}
        }
    }

    /// Goes back by one kept state.
    pub(super) fn step_back(&mut self) {
        self.let_go();
        self.order(Order::Back(self.frame.steps.saturating_sub(1)));
    }
}
