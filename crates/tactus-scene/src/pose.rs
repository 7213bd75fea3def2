//! Position and attitude of the tool.

/// A tool's position, attitude and depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The tool's origin along x and y, in mm, sensor frame.
    pub position_mm: [f64; 2],
    /// Rotation about the tool's origin.
    pub attitude: Attitude,
    /// Depth of its lowest point, in this attitude, below the undeformed surface, in mm. There is no contact at 0 or less.
    pub depth_mm: f64,
}

/// A rotation from the tool's frame to the sensor's: first roll about x, then pitch about y, then yaw about z,
/// each counter-clockwise seen from the axis's end. All angles in degrees, of any finite size.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Attitude {
    /// About z, which is upwards out of the sensor.
    pub yaw_deg: f64,
    /// About y.
    pub pitch_deg: f64,
    /// About x.
    pub roll_deg: f64,
}

impl Attitude {
    /// Upright, turned about its axis only.
    pub fn upright(yaw_deg: f64) -> Self {
        Self { yaw_deg, ..Self::default() }
    }

    /// `R_z(yaw) R_y(pitch) R_x(roll)`, row by row.
    pub fn matrix(self) -> [[f64; 3]; 3] {
        let [(sa, ca), (sb, cb), (sc, cc)] =
            [self.yaw_deg, self.pitch_deg, self.roll_deg].map(|angle| angle.to_radians().sin_cos());
        [
            [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
            [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
            [-sb, cb * sc, cb * cc],
        ]
    }
}

#[cfg(test)]
#[path = "pose_tests.rs"]
mod tests;
