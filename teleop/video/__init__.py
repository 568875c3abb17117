"""Pictures of the robot's cameras over HTTP, at the addresses of ROS's ``web_video_server``, and photographs."""
