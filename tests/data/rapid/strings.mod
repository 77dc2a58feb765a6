MODULE Strings
  CONST string a:="say ""yes"" now";
  CONST string b:="back\\slash \0D\0A";
  CONST string c:="";
  CONST string d:="""";
  CONST string e:="a;b IF THEN :=";
  PROC main()
    TPWrite"x"\Num:=1;
    TPWrite "a"+"b"+ValToStr(1);
  ENDPROC
ENDMODULE
