//! Position and rotation of the sensor in the robot frame.

/// Rigid transform between the robot frame and the sensor frame, in the plane.
///
/// `p_sensor = Rot(-rotation) (p_robot - origin)`
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Registration {
    /// The sensor frame's origin in robot coordinates.
    pub origin_mm: [f64; 2],
    /// Angle from the robot's x axis to the sensor's, counter-clockwise seen from above.
    pub rotation_deg: f64,
}

impl Registration {
    /// Sensor coordinates of a point given in robot coordinates.
    pub fn to_sensor(&self, robot_mm: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.rotation_deg.to_radians().sin_cos();
        let (dx, dy) = (robot_mm[0] - self.origin_mm[0], robot_mm[1] - self.origin_mm[1]);
        [cos * dx + sin * dy, -sin * dx + cos * dy]
    }

    /// Robot coordinates of a point given in sensor coordinates.
    pub fn to_robot(&self, sensor_mm: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.rotation_deg.to_radians().sin_cos();
        [
            self.origin_mm[0] + cos * sensor_mm[0] - sin * sensor_mm[1],
            self.origin_mm[1] + sin * sensor_mm[0] + cos * sensor_mm[1],
        ]
    }
}

#[cfg(test)]
#[path = "registration_tests.rs"]
mod tests;
