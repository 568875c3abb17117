"""Where could the robot be? Windows, whole maps, and places told apart by driving on."""
