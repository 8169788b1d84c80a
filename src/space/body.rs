//! The properties of a body.

use crate::Membership;

/// What a body of a [`Space`](crate::Space) may meet, and a number of the caller's.
///
/// ```
/// use sapwise::Body;
///
/// let wall = Body::fixed();
/// let player = Body::default().groups(1).masks(6).user_data(42);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Body {
    pub(super) membership: Membership,
    /// Whether it is expected to move, although it counts as fixed for the filter.
    kinematic: bool,
    user_data: u64,
}

/// Makes a body that may meet what the membership says.
impl From<Membership> for Body {
    fn from(membership: Membership) -> Self {
        Self { membership, ..Self::default() }
    }
}

impl Body {
    /// Makes a body that meets no other fixed or kinematic body. Use it for what rarely moves: walls, the ground. It
    /// may be [set](crate::Space::set) all the same.
    pub fn fixed() -> Self {
        Membership { fixed: true, ..Membership::ALL }.into()
    }

    /// Makes a body that the program moves along a path, such as a lift. It meets neither fixed bodies nor kinematic
    /// ones.
    pub fn kinematic() -> Self {
        Self { kinematic: true, ..Self::fixed() }
    }

    /// Sets the groups of the body, one bit each. The default is all.
    #[must_use]
    pub fn groups(mut self, groups: u32) -> Self {
        self.membership.groups = groups;
        self
    }

    /// Sets the groups that the body meets, one bit each. The masks of both bodies of a pair must allow the other. The
    /// default is all.
    #[must_use]
    pub fn masks(mut self, masks: u32) -> Self {
        self.membership.mask = masks;
        self
    }

    /// Sets what the body is a part of, such as a ragdoll. Bodies with the same owner do not meet. The default is 0,
    /// which is no owner.
    #[must_use]
    pub fn owner(mut self, owner: u32) -> Self {
        self.membership.owner = owner;
        self
    }

    /// Sets a number of the caller's, which the space keeps.
    #[must_use]
    pub fn user_data(mut self, user_data: u64) -> Self {
        self.user_data = user_data;
        self
    }

    /// Returns the number set by [`user_data`](Self::user_data), 0 by default.
    pub fn get_user_data(&self) -> u64 {
        self.user_data
    }

    /// Returns whether the body was made by [`kinematic`](Self::kinematic).
    pub fn is_kinematic(&self) -> bool {
        self.kinematic
    }

    /// Returns whether the body may rest in the first update after its insertion.
    pub(super) fn rests_at_once(&self) -> bool {
        self.membership.fixed && !self.kinematic
    }

    /// Returns the groups, the mask, the owner, and whether the body is fixed or kinematic.
    pub fn membership(&self) -> &Membership {
        &self.membership
    }
}
