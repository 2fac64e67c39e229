"""What do bench recordings say about the device, and how surely?"""
