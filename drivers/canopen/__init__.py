"""The CAN bus and CANopen services (CiA 301)."""
