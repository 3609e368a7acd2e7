//! Locations and roll, pitch, yaw (ROS REP-103 body axes).
