"""Lightest parts with which a wearer walks for a required time on one bottle."""
